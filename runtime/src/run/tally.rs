//! What a run measures, in memory of fixed size.

use super::rate::ScanRate;
use crate::latency::Latencies;
use nav_core::guard::Cause;
use nav_core::messages::{Goal, Header, Odometry, RunState, fault};
use nav_core::shield::Hazard;
use nav_core::tick::{Inputs, TickStatus};
use nav_model::alloc::Counts;

/// More kinds of causes than there are.
const CAUSES: usize = 32;

/// Ticks in which what was wished is not safe.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ShieldTally {
    /// Because of somebody who moves.
    pub persons: u64,
    /// Because of something that was too near to stop.
    pub obstacles: u64,
    /// Without a safe command, of both.
    pub forced: u64,
}

impl ShieldTally {
    fn note(&mut self, status: &TickStatus) {
        let Some(intervention) = &status.intervention else { return };
        match intervention.hazard {
            Hazard::Person => self.persons += 1,
            Hazard::Standing => self.obstacles += 1,
        }
        self.forced += u64::from(intervention.is_forced);
    }
}

/// What a run adds up to. Nothing here allocates after [`Tally::new`].
#[derive(Clone, Debug)]
pub struct Tally {
    /// The control period, ns.
    pub period_ns: u64,
    /// Ticks done.
    pub ticks: u64,
    /// Ticks that ended after the next deadline.
    pub overruns: u64,
    /// Whole periods skipped because of them.
    pub skipped_periods: u64,
    /// From wake-up to the published command, ns.
    pub tick: Latencies,
    /// The controller alone: observation, networks, guard, ns.
    pub controller: Latencies,
    /// From the scan's stamp to the published command, ns; of new scans, in clock pace only.
    pub scan_to_command: Latencies,
    /// Scans that another one replaced before they were read: gaps in their sequence, in clock pace only.
    pub scans_replaced: u64,
    /// How late the loop woke up when no scan started the tick, ns.
    pub wake_late: Latencies,
    /// Difference between one period and the next, ns; clock pace only.
    pub jitter: Latencies,
    /// Ticks in each [`RunState`].
    pub states: [u64; RunState::ALL.len()],
    /// Ticks with each fault bit.
    pub faults: [u64; fault::NAMES.len()],
    /// The first cause of each kind.
    pub causes: heapless::Vec<Cause, CAUSES>,
    /// Goals received.
    pub goals: u64,
    /// Goals reached, or as near as that can be told when the next one came or the scans ended.
    pub goals_reached: u64,
    /// Driven as the odometry saw it, m.
    pub distance_m: f64,
    /// Allocations and releases in the loop, after arming.
    pub heap: Counts,
    /// Peers that joined or left after arming, and what connecting to them took.
    pub reconnects: u64,
    /// See `reconnects`.
    pub reconnect_heap: Counts,
    /// What the safety gate did.
    pub shield: ShieldTally,
    /// Ticks that decided on a subgoal.
    pub decisions: u64,
    /// When the loop was armed and when it ended, ns.
    pub armed_ns: u64,
    /// See `armed_ns`.
    pub ended_ns: u64,
    goal_id: Option<u32>,
    goal_done: bool,
    last_goal_gap_m: f32,
    /// Where the goal was last, and the farthest that a correction has moved it, m.
    last_goal: Goal,
    corrected_m: f32,
    last_odom: Odometry,
    last_scan_seq: Option<u64>,
    last_tick_ns: Option<u64>,
    last_interval_ns: Option<u64>,
    scan_rate: ScanRate,
}

impl Tally {
    /// Nothing measured yet.
    pub fn new(period_ns: u64) -> Self {
        Self {
            period_ns,
            ticks: 0,
            overruns: 0,
            skipped_periods: 0,
            tick: Latencies::default(),
            controller: Latencies::default(),
            scan_to_command: Latencies::default(),
            scans_replaced: 0,
            wake_late: Latencies::default(),
            jitter: Latencies::default(),
            states: [0; RunState::ALL.len()],
            faults: [0; fault::NAMES.len()],
            causes: heapless::Vec::new(),
            goals: 0,
            goals_reached: 0,
            distance_m: 0.0,
            heap: Counts::default(),
            reconnects: 0,
            reconnect_heap: Counts::default(),
            shield: ShieldTally::default(),
            decisions: 0,
            armed_ns: 0,
            ended_ns: 0,
            goal_id: None,
            goal_done: false,
            last_goal_gap_m: f32::INFINITY,
            last_goal: Goal::default(),
            corrected_m: 0.0,
            last_odom: Odometry::default(),
            last_scan_seq: None,
            last_tick_ns: None,
            last_interval_ns: None,
            scan_rate: ScanRate::new(period_ns),
        }
    }

    /// Counts what a tick did. `step_max_m` is the way of one period at full speed, m.
    pub fn note(&mut self, inputs: &Inputs<'_>, status: &TickStatus, step_max_m: f32) {
        self.ticks += 1;
        self.states[status.state as usize] += 1;
        for (bit, count) in self.faults.iter_mut().enumerate() {
            *count += u64::from(status.faults >> bit & 1);
        }
        self.decisions += u64::from(status.decided.is_some());
        self.shield.note(status);
        if let Some(cause) = &status.cause {
            self.note_cause(cause);
        }
        self.note_goal(inputs, status, step_max_m);
        self.note_distance(inputs.odom, step_max_m);
    }

    /// Keeps a cause that is the first of its kind; whether it was.
    pub fn note_cause(&mut self, cause: &Cause) -> bool {
        let is_first = !self.causes.iter().any(|known| known.is_like(cause));
        is_first && self.causes.push(*cause).is_ok()
    }

    fn note_goal(&mut self, inputs: &Inputs<'_>, status: &TickStatus, step_max_m: f32) {
        if status.faults & fault::STOPPING != 0 {
            if status.faults & fault::STALE_SCAN != 0 {
                self.settle_goal(step_max_m);
            }
            return;
        }
        if self.goal_id != Some(inputs.goal.id) {
            self.settle_goal(step_max_m);
            self.goal_id = Some(inputs.goal.id);
            self.goal_done = false;
            self.goals += 1;
            (self.last_goal, self.corrected_m) = (*inputs.goal, 0.0);
        }
        let moved_m = (inputs.goal.x_m - self.last_goal.x_m).hypot(inputs.goal.y_m - self.last_goal.y_m);
        (self.last_goal, self.corrected_m) = (*inputs.goal, self.corrected_m.max(moved_m));
        if status.state == RunState::Reached && !self.goal_done {
            self.goal_done = true;
            self.goals_reached += 1;
        }
        self.last_goal_gap_m = status.goal_distance_m - inputs.goal.radius_m;
    }

    /// The goal that nothing more is heard of counts as reached if it was less than a step away: a simulator
    /// leaves or moves on as soon as it is reached, so that its last scan shows the step before. It goes by where the robot
    /// truly is, which the robot knows no better than its goal's corrections were large.
    fn settle_goal(&mut self, step_max_m: f32) {
        if !self.goal_done && self.last_goal_gap_m <= step_max_m + self.corrected_m {
            self.goal_done = true;
            self.goals_reached += 1;
        }
    }

    /// A jump that no robot can make (a new episode, a reset of the odometry) is no distance.
    fn note_distance(&mut self, odom: &Odometry, step_max_m: f32) {
        let steps = odom.header.seq.saturating_sub(self.last_odom.header.seq);
        let moved_m = (odom.pose.position() - self.last_odom.pose.position()).norm();
        if self.last_odom.header.is_received() && moved_m <= 2.0 * step_max_m * steps as f32 {
            self.distance_m += f64::from(moved_m);
        }
        self.last_odom = *odom;
    }

    /// Counts when a tick began, for the jitter.
    pub fn note_start(&mut self, woken_ns: u64) {
        let interval_ns = self.last_tick_ns.map(|last_ns| woken_ns.saturating_sub(last_ns));
        if let (Some(interval_ns), Some(last_ns)) = (interval_ns, self.last_interval_ns) {
            self.jitter.record(interval_ns.abs_diff(last_ns));
        }
        self.last_interval_ns = interval_ns;
        self.last_tick_ns = Some(woken_ns);
    }

    /// Counts a new scan that was answered at `sent_ns`, and those between it and the one before. A sequence that
    /// begins anew, lower, leaves no gap.
    pub fn note_answer(&mut self, scan: &Header, sent_ns: u64) {
        self.scan_to_command.record(sent_ns.saturating_sub(scan.stamp_ns));
        if let Some(cause) = self.scan_rate.note(scan) {
            self.note_cause(&cause);
        }
        let last_seq = self.last_scan_seq.replace(scan.seq).unwrap_or(scan.seq);
        self.scans_replaced += scan.seq.saturating_sub(last_seq).saturating_sub(1);
    }

    /// Counts periods that were skipped after a late tick.
    pub fn note_skipped(&mut self, skipped: u64) {
        self.overruns += u64::from(skipped > 0);
        self.skipped_periods += skipped;
    }

    /// Ends the count; `peer_left` when it ended because whoever published the scans left.
    pub fn close(&mut self, ended_ns: u64, peer_left: bool, step_max_m: f32) {
        self.ended_ns = ended_ns;
        if peer_left {
            self.settle_goal(step_max_m);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nav_core::geometry::Pose;
    use nav_core::messages::LaserScan;

    fn tick(tally: &mut Tally, seq: u64, x_m: f32, goal: (u32, f32), state: RunState) {
        tick_with(tally, seq, x_m, goal, (state, 0));
    }

    fn tick_with(tally: &mut Tally, seq: u64, x_m: f32, goal: (u32, f32), (state, faults): (RunState, u32)) {
        let header = Header { stamp_ns: seq, seq };
        let odom = Odometry { header, pose: Pose::new(x_m, 0.0, 0.0), ..Odometry::default() };
        let message = Goal { header, id: goal.0, radius_m: 0.3, ..Goal::default() };
        let scan = LaserScan::default();
        let status = TickStatus { state, faults, goal_distance_m: goal.1, ..TickStatus::default() };
        tally.note(&Inputs { scan: &scan, odom: &odom, goal: &message }, &status, 0.1);
    }

    #[test]
    fn distance_ignores_jumps_and_goals_are_counted_once() {
        let mut tally = Tally::new(100);
        for step in 0..11_u16 {
            tick(&mut tally, u64::from(step) + 1, f32::from(step) * 0.1, (1, 5.0), RunState::Driving);
        }
        tick(&mut tally, 12, 1.05, (1, 0.2), RunState::Reached);
        tick(&mut tally, 13, 1.05, (1, 0.2), RunState::Reached);
        // A new episode elsewhere; it ends one step before the goal, as a simulator shows it.
        tick(&mut tally, 14, -7.0, (2, 0.35), RunState::Driving);
        tick(&mut tally, 15, -7.0, (3, 9.0), RunState::Driving);
        // The fourth is reached in the step that its simulator no longer shows before it leaves.
        tick(&mut tally, 16, -7.0, (4, 0.39), RunState::Driving);
        tick_with(&mut tally, 16, -7.0, (4, 0.39), (RunState::Ready, fault::STALE_SCAN));
        tally.close(0, true, 0.1);
        assert!((tally.distance_m - 1.05).abs() < 1e-5, "{}", tally.distance_m);
        assert_eq!((tally.goals, tally.goals_reached), (4, 3));
        assert_eq!(tally.states[RunState::Reached as usize], 2);
    }

    /// A localiser that errs by 5 cm, and a robot that drives 2 cm in a step: who truly is at the goal may seem farther away
    /// from it than a step.
    #[test]
    fn a_slow_robot_is_believed_as_far_as_its_localiser_errs() {
        for (corrected_m, gap_m, reached) in [(0.05, 0.06, 1), (0.0, 0.06, 0), (0.05, 0.2, 0)] {
            let mut tally = Tally::new(100);
            for (seq, x_m) in [(1, 0.0), (2, corrected_m), (3, corrected_m)] {
                let header = Header { stamp_ns: seq, seq };
                let goal = Goal { header, id: 7, x_m, radius_m: 0.15, ..Goal::default() };
                let status = TickStatus {
                    state: RunState::Driving,
                    goal_distance_m: goal.radius_m + gap_m,
                    ..TickStatus::default()
                };
                let (scan, odom) = (LaserScan::default(), Odometry { header, ..Odometry::default() });
                tally.note(&Inputs { scan: &scan, odom: &odom, goal: &goal }, &status, 0.022);
            }
            tally.close(0, true, 0.022);
            assert_eq!((tally.goals, tally.goals_reached), (1, reached), "{corrected_m} {gap_m}");
        }
    }

    #[test]
    fn scans_between_two_answers_are_unanswered() {
        let mut tally = Tally::new(100);
        // Four and five were overwritten; then another publisher begins anew.
        for seq in [2, 3, 6, 7, 1, 2] {
            tally.note_answer(&Header { stamp_ns: 10, seq }, 30);
        }
        assert_eq!((tally.scan_to_command.percentiles().count, tally.scans_replaced), (6, 2));
    }

    #[test]
    fn jitter_is_the_change_of_the_interval() {
        let mut tally = Tally::new(100);
        for start_ns in [0, 100, 200, 350, 450] {
            tally.note_start(start_ns);
        }
        let jitter = tally.jitter.percentiles();
        assert_eq!((jitter.count, jitter.max_ns), (3, 50));
    }
}
