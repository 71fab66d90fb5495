//! The tick: from messages to a velocity command. The one definition of acting, for the robot and for
//! evaluation; training takes the same steps of the same navigator and guard with choices of its own.

use crate::guard::{Cause, Guard, command_age_limit_ns};
use crate::messages::{CmdVel, Header, fault};
use crate::navigator::Navigator;
use crate::network::Network;
use crate::observation::{CANDIDATE_FEATURES, LOW_ACTION, LOW_OBSERVATION, expand_candidates};
use crate::run_state::run_state;
use crate::shield::Shield;
use crate::shielding::Shielding;
use crate::task::{ACTION_COUNT, ACTION_GOAL, ShieldMode, Task};
use crate::tick::{Inputs, Tick, TickStatus};
use crate::twist::Twist;

/// Two networks (or one: a flat policy always chooses GOAL), the navigator and the guard.
///
/// `S` is the networks' memory: anything that lends a slice, so that the caller decides where weights live.
#[derive(Debug)]
pub struct Controller<S> {
    task: Task,
    navigator: Navigator,
    guard: Guard,
    shielding: Shielding,
    high: Option<Network<S>>,
    low: Network<S>,
    candidates: [f32; ACTION_COUNT * CANDIDATE_FEATURES],
    values: [f32; ACTION_COUNT],
    low_observation: [f32; LOW_OBSERVATION],
    commands: u64,
    goal_id: Option<u32>,
    last_tick_ns: u64,
    last_scan_seq: u64,
}

/// A network whose shape is not what the observation layout says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ShapeError {
    /// `dqn` or `td3`.
    pub network: &'static str,
    /// Input and output lengths that the layout asks for.
    pub expected: (usize, usize),
    /// Those of the network.
    pub found: (usize, usize),
}

impl core::fmt::Display for ShapeError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let Self { network, expected, found } = self;
        write!(
            f,
            "the {network} network maps {} numbers to {}, but this build's observation layout needs {} to {}: \
             use a model exported by the same version",
            found.0, found.1, expected.0, expected.1
        )
    }
}

impl core::error::Error for ShapeError {}

impl<S: AsRef<[f32]> + AsMut<[f32]>> Controller<S> {
    /// A controller at a standstill, before its first goal. Without a `high` network it is a flat policy.
    ///
    /// # Errors
    /// A network of another shape.
    pub fn new(task: &Task, high: Option<Network<S>>, low: Network<S>) -> Result<Self, ShapeError> {
        let check = |network, found: (usize, usize), expected: (usize, usize)| {
            if found == expected { Ok(()) } else { Err(ShapeError { network, expected, found }) }
        };
        check("td3", (low.input_len(), low.output_len()), (LOW_OBSERVATION, LOW_ACTION))?;
        if let Some(high) = &high {
            let expected = (ACTION_COUNT * CANDIDATE_FEATURES, ACTION_COUNT);
            check("dqn", (high.input_len(), high.output_len()), expected)?;
        }
        Ok(Self {
            task: *task,
            navigator: Navigator::new(task),
            guard: Guard::new(task),
            shielding: Shielding::new(task),
            high,
            low,
            candidates: [0.0; ACTION_COUNT * CANDIDATE_FEATURES],
            values: [0.0; ACTION_COUNT],
            low_observation: [0.0; LOW_OBSERVATION],
            commands: 0,
            goal_id: None,
            last_scan_seq: 0,
            last_tick_ns: 0,
        })
    }
}

impl<S: AsRef<[f32]> + AsMut<[f32]>> Tick for Controller<S> {
    /// Faulty input commands a ramp to zero in the same tick. The same scan seen twice is driven on with
    /// the guard's limits, without counting as a step of the policy.
    fn tick(&mut self, now_ns: u64, inputs: Inputs<'_>) -> (CmdVel, TickStatus) {
        let Inputs { scan, odom, goal } = inputs;
        let mut status = TickStatus { action: ACTION_GOAL, ..TickStatus::default() };
        (status.faults, status.cause) = self.guard.inspect(now_ns, scan, odom, goal);
        if scan.header.is_received()
            && let Err(misfit) = self.navigator.inspect_scan(scan)
        {
            status.faults |= fault::BAD_SCAN;
            status.cause = status.cause.or(Some(Cause::Scan(misfit)));
        }
        let since_ns = now_ns.saturating_sub(self.last_tick_ns);
        let was_away = since_ns > self.task.control_period_ns() * 3 / 2;
        let mut wish = Twist::ZERO;
        if was_away && since_ns > command_age_limit_ns(self.task.control_period_ns()) {
            // The base obeys no longer, whether inputs are faulty or not.
            self.guard.restart_from(odom.twist(), since_ns);
        }
        if status.faults & fault::STOPPING == 0 {
            // After a pause of this program only odometry knows what the base does. A new goal is no pause, unless
            // the robot stands: then it may have been set down elsewhere.
            let stands = odom.twist() == Twist::ZERO;
            let is_new = self.goal_id != Some(goal.id);
            if was_away || self.goal_id.is_none() || (is_new && stands) {
                self.guard.restart_from(odom.twist(), since_ns);
            }
            self.goal_id = Some(goal.id);
            if scan.header.seq != self.last_scan_seq {
                self.last_scan_seq = scan.header.seq;
                self.navigator.observe(scan, odom, goal);
                self.shielding.observe(scan, odom, &self.navigator);
            }
            if !self.navigator.goal_reached() {
                wish = self.act(&mut status);
                status.wish = self.task.robot.limited(wish);
                let (command, intervention, acted) =
                    self.shielding.filter(wish, odom, &self.guard, &self.navigator);
                (wish, status.intervention) = (command, intervention);
                status.faults |= acted;
            }
        } else {
            self.navigator.note_gap();
            if status.faults & (fault::BAD_CLOCK | fault::BAD_ODOM) != 0 {
                // Whoever publishes has begun anew, and with it perhaps the odom frame.
                self.navigator.forget();
                self.shielding.forget();
                (self.goal_id, self.last_scan_seq) = (None, 0);
            }
        }
        self.last_tick_ns = now_ns;
        let (out, limited) = self.guard.limit_after(since_ns as f32 / 1e9, wish);
        status.faults |= limited;
        if status.faults & fault::STOPPING == 0 {
            self.guard.note_drive(now_ns, out, self.navigator.scan().sectors_m());
        }
        // A goal that no scan was seen with is not reached, whatever the last one was.
        let is_reached = self.navigator.goal_reached() && self.navigator.knows(goal);
        status.state = run_state(status.faults, is_reached);
        status.goal_distance_m = self.navigator.goal_distance_m();
        if let Some(decision) = self.navigator.decision() {
            status.action = decision.action;
            status.subgoal_m = (decision.subgoal.x, decision.subgoal.y);
        }
        self.commands += 1;
        let command = CmdVel {
            header: Header { stamp_ns: now_ns, seq: self.commands },
            linear_mps: out.linear_mps,
            angular_radps: out.angular_radps,
            scan_seq: scan.header.seq,
            faults: status.faults,
            state: status.state as u32,
        };
        (command, status)
    }

    fn task(&self) -> &Task {
        &self.task
    }
}

impl<S: AsRef<[f32]> + AsMut<[f32]>> Controller<S> {
    /// Decides if a decision is due, then asks the low level. A value that is not finite falls back to a NaN
    /// wish, which the guard turns into a named stop.
    fn act(&mut self, status: &mut TickStatus) -> Twist {
        if let Some(reason) = self.navigator.decision_due() {
            status.decided = Some(reason);
            let action = match &mut self.high {
                None => {
                    self.navigator.commit(ACTION_GOAL);
                    ACTION_GOAL
                }
                Some(high) => {
                    let (observation, mask) = self.navigator.prepare_decision();
                    expand_candidates(observation, &mut self.candidates);
                    high.run(&self.candidates, &mut self.values);
                    let Some(action) = mask.best(&self.values, self.task.decision.deviation_margin) else {
                        return Twist::new(f32::NAN, f32::NAN);
                    };
                    self.navigator.commit(action);
                    action
                }
            };
            status.action = action;
        }
        if self.navigator.is_waiting() {
            return Twist::ZERO;
        }
        self.navigator.encode_low(self.guard.sent(), &mut self.low_observation);
        let mut action = [0.0; LOW_ACTION];
        self.low.run(&self.low_observation, &mut action);
        if self.navigator.scan().is_closed_ahead() {
            status.faults |= fault::CLOSED_AHEAD;
        }
        if self.task.robot.reverses() && self.navigator.scan().is_closed_behind() {
            status.faults |= fault::CLOSED_BEHIND;
        }
        self.navigator.decode_low(action)
    }

    /// A finite range from which on the lidar's driver means that nothing was hit, m.
    pub fn set_no_return_m(&mut self, no_return_m: f32) {
        self.navigator.set_no_return_m(no_return_m);
        self.shielding.set_no_return_m(no_return_m);
    }

    /// Goals must be repeated: one that is older than this is stale, ns.
    pub fn set_goal_age_limit_ns(&mut self, limit_ns: Option<u64>) {
        self.guard.set_goal_age_limit_ns(limit_ns);
    }

    /// The safety gate, unless it is switched off.
    pub fn shield(&self) -> Option<&Shield> {
        self.shielding.shield()
    }

    /// See [`Self::shield`].
    pub fn shield_mut(&mut self) -> Option<&mut Shield> {
        self.shielding.shield_mut()
    }

    /// Switches the safety gate on or off, whatever the task says.
    pub fn set_shield(&mut self, mode: ShieldMode) {
        self.task.shield = mode;
        self.shielding.switch(mode);
        self.navigator.set_shield(mode);
    }

    /// The navigator, for pictures and records.
    pub fn navigator(&self) -> &Navigator {
        &self.navigator
    }
}
