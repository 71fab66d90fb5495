//! The guard: what may leave for the base. First version: stale, impossible or non-finite input stops the
//! robot in the same tick; speed and acceleration are limited always, also while stopping.

use crate::messages::{Goal, LaserScan, Odometry, fault};
use crate::observation::Sent;
use crate::scan::VALID_BEAM_SHARE_MIN;
use crate::task::Task;
use crate::twist::Twist;
use core::f32::consts::TAU;

/// A scan older than this many control periods is stale.
pub const SCAN_AGE_PERIODS: f64 = 2.5;
/// Odometry older than this many control periods is stale.
pub const ODOM_AGE_PERIODS: f64 = 5.0;
/// No input may be older than this, ns, however long the period.
pub const AGE_LIMIT_NS: u64 = 500_000_000;

/// The age at which a command stops counting for the base, ns: five control periods or 100 ms, whichever is
/// shorter, but two and a half periods at least, so that one late command does not stop a slow robot.
pub const fn command_age_limit_ns(period_ns: u64) -> u64 {
    let short = if 5 * period_ns < 100_000_000 { 5 * period_ns } else { 100_000_000 };
    let least = 5 * period_ns / 2;
    if short > least { short } else { least }
}

/// Failed beams side by side may not hide more than this, rad.
pub const BLIND_MAX_RAD: f32 = TAU / 8.0;

/// Between the policy and the base: judges what comes in, limits what goes out.
#[derive(Clone, Debug)]
pub struct Guard {
    task: Task,
    sent: Sent,
    last_scan: (u64, u64),
    last_odom: (u64, u64),
}

impl Guard {
    /// At a standstill.
    pub fn new(task: &Task) -> Self {
        Self { task: *task, sent: Sent::default(), last_scan: (0, 0), last_odom: (0, 0) }
    }

    /// What is wrong with the inputs at `now_ns`, as [`fault`] bits.
    pub fn inspect(&mut self, now_ns: u64, scan: &LaserScan, odom: &Odometry, goal: &Goal) -> u32 {
        let period_ns = self.task.control_period_ns() as f64;
        let limit_ns = |periods: f64| ((periods * period_ns) as u64).min(AGE_LIMIT_NS);
        let mut faults = 0;
        if !scan.header.is_received() || scan.header.age_ns(now_ns) > limit_ns(SCAN_AGE_PERIODS) {
            faults |= fault::STALE_SCAN;
        }
        if !odom.header.is_received() || odom.header.age_ns(now_ns) > limit_ns(ODOM_AGE_PERIODS) {
            faults |= fault::STALE_ODOM;
        }
        if !goal.header.is_received() {
            faults |= fault::NO_GOAL;
        }
        let scan_now = (scan.header.seq, scan.header.stamp_ns);
        let odom_now = (odom.header.seq, odom.header.stamp_ns);
        if scan.header.is_from_future(now_ns)
            || odom.header.is_from_future(now_ns)
            || runs_backwards(self.last_scan, scan_now)
            || runs_backwards(self.last_odom, odom_now)
        {
            faults |= fault::BAD_CLOCK;
        }
        (self.last_scan, self.last_odom) = (scan_now, odom_now);
        let numbers = [
            odom.pose.x_m,
            odom.pose.y_m,
            odom.pose.yaw_rad,
            odom.linear_mps,
            odom.angular_radps,
            goal.x_m,
            goal.y_m,
            goal.radius_m,
        ];
        // Beyond 100 km a float has no centimetres left.
        let is_odd = numbers.iter().any(|value| !value.is_finite() || value.abs() > 1e5);
        if is_odd || (goal.header.is_received() && goal.radius_m <= 0.0) {
            faults |= fault::BAD_INPUT;
        }
        faults
    }

    /// What is wrong with the scan itself, as [`fault`] bits: another geometry, too few valid beams, or too many
    /// failed ones side by side.
    pub fn inspect_scan(&self, scan: &LaserScan) -> u32 {
        if !scan.header.is_received() {
            return 0;
        }
        let range_min_m = self.task.lidar.range_min_m.max(scan.range_min_m);
        let valid = scan.ranges_m().iter().filter(|range| **range >= range_min_m).count();
        let enough = valid as f32 >= VALID_BEAM_SHARE_MIN * scan.ranges_m().len() as f32
            && blind_rad(scan, range_min_m) < BLIND_MAX_RAD;
        if self.task.lidar.fits(scan) && enough { 0 } else { fault::BAD_SCAN }
    }

    /// Cuts a wish to the limits of speed and acceleration; a wish that is not finite is zero. Returns what may
    /// leave, and why it differs as [`fault`] bits.
    pub fn limit(&mut self, wish: Twist) -> (Twist, u32) {
        let robot = &self.task.robot;
        let mut faults = 0;
        let mut finite = wish;
        if !wish.is_finite() {
            faults |= fault::NON_FINITE;
            finite = Twist::ZERO;
        }
        let speed = robot.limited(finite);
        if speed != finite {
            faults |= fault::SPEED_LIMITED;
        }
        let out = robot.ramped(self.sent[0], speed, self.task.control_period_s);
        if out != speed {
            faults |= fault::ACCELERATION_LIMITED;
        }
        self.sent.rotate_right(1);
        self.sent[0] = out;
        (out, faults)
    }

    /// Starts afresh from a measured velocity: after a new goal, or a reset of the base.
    pub fn restart_from(&mut self, measured: Twist) {
        self.sent.fill(self.task.robot.limited(measured));
    }

    /// The last commands that left; after a restart, what the base was measured to do.
    pub fn sent(&self) -> &Sent {
        &self.sent
    }
}

/// Whether (seq, stamp) went back, or one of them stood still while the other went on.
fn runs_backwards(last: (u64, u64), now: (u64, u64)) -> bool {
    now.0 < last.0 || now.1 < last.1 || (now.0 == last.0) != (now.1 == last.1)
}

/// The longest run of failed measurements among neighbouring beams, rad.
fn blind_rad(scan: &LaserScan, range_min_m: f32) -> f32 {
    let beams = scan.ranges_m();
    let is_circle = beams.len() as f32 * scan.angle_increment_rad > TAU - 1e-3;
    let turns = if is_circle { 2 } else { 1 };
    let (mut run, mut longest) = (0_usize, 0);
    for range_m in beams.iter().cycle().take(turns * beams.len()) {
        run = if *range_m >= range_min_m { 0 } else { run + 1 };
        longest = longest.max(run);
    }
    longest.min(beams.len()) as f32 * scan.angle_increment_rad
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::Header;

    fn fresh(now_ns: u64) -> (LaserScan, Odometry, Goal) {
        let header = Header { stamp_ns: now_ns, seq: 7 };
        (
            LaserScan { header, ..LaserScan::default() },
            Odometry { header, ..Odometry::default() },
            Goal { header, radius_m: 0.3, ..Goal::default() },
        )
    }

    #[test]
    fn fresh_inputs_pass_and_each_fault_is_named() {
        let now = 1_000_000_000;
        let (scan, odom, goal) = fresh(now);
        let inspect = |scan: &LaserScan, odom: &Odometry, goal: &Goal, now: u64| {
            Guard::new(&Task::default()).inspect(now, scan, odom, goal)
        };
        assert_eq!(inspect(&scan, &odom, &goal, now), 0);
        assert_eq!(inspect(&scan, &odom, &goal, now + 250_000_000), 0);
        assert_eq!(inspect(&scan, &odom, &goal, now + 250_000_001), fault::STALE_SCAN);
        assert_eq!(inspect(&scan, &odom, &goal, now + 500_000_001), fault::STALE_SCAN | fault::STALE_ODOM);
        assert_eq!(inspect(&scan, &odom, &Goal::default(), now), fault::NO_GOAL);
        assert_eq!(inspect(&LaserScan::default(), &odom, &goal, now), fault::STALE_SCAN);
        assert_eq!(inspect(&scan, &odom, &goal, now - 1), fault::BAD_CLOCK);
        let mut lost = odom;
        lost.pose.x_m = f32::NAN;
        assert_eq!(inspect(&scan, &lost, &goal, now), fault::BAD_INPUT);
    }

    #[test]
    fn time_may_not_run_backwards() {
        let now = 1_000_000_000;
        let (mut scan, odom, goal) = fresh(now);
        let mut guard = Guard::new(&Task::default());
        assert_eq!(guard.inspect(now, &scan, &odom, &goal), 0);
        assert_eq!(guard.inspect(now, &scan, &odom, &goal), 0, "the same scan again is merely old");
        scan.header.seq = 6;
        assert_eq!(guard.inspect(now, &scan, &odom, &goal), fault::BAD_CLOCK);
        scan.header = Header { seq: 8, stamp_ns: now };
        let mut guard = Guard::new(&Task::default());
        guard.inspect(now, &fresh(now).0, &odom, &goal);
        assert_eq!(guard.inspect(now, &scan, &odom, &goal), fault::BAD_CLOCK, "a frozen clock");
        let mut guard = Guard::new(&Task::default());
        guard.inspect(now, &fresh(now).0, &odom, &goal);
        scan.header = Header { seq: 7, stamp_ns: now + 1 };
        assert_eq!(guard.inspect(now + 1, &scan, &odom, &goal), fault::BAD_CLOCK, "a frozen counter");
    }

    #[test]
    fn scattered_failures_pass_and_a_blind_wedge_does_not() {
        let task = Task::default();
        let guard = Guard::new(&task);
        let inspect = |failed: &dyn Fn(usize) -> bool| {
            let mut scan = LaserScan::of(&task.lidar, |_| 3.0);
            scan.header = Header { stamp_ns: 1, seq: 1 };
            for beam in 0..task.lidar.beam_count as usize {
                if failed(beam) {
                    scan.ranges_m[beam] = f32::NAN;
                }
            }
            guard.inspect_scan(&scan)
        };
        assert_eq!(inspect(&|_| false), 0);
        assert_eq!(inspect(&|beam| beam % 5 == 0), 0, "a fifth, scattered");
        assert_eq!(inspect(&|beam| beam % 3 == 0), fault::BAD_SCAN, "a third");
        assert_eq!(inspect(&|beam| (30..38).contains(&beam)), 0, "40 degrees");
        assert_eq!(inspect(&|beam| (30..40).contains(&beam)), fault::BAD_SCAN, "50 degrees ahead");
        assert_eq!(inspect(&|beam| !(5..67).contains(&beam)), fault::BAD_SCAN, "50 degrees behind");
    }

    #[test]
    fn wishes_are_cut_to_the_limits() {
        let mut guard = Guard::new(&Task::default());
        let (out, faults) = guard.limit(Twist::new(9.0, -9.0));
        assert!((out.linear_mps - 0.2).abs() < 1e-6 && (out.angular_radps + 0.4).abs() < 1e-6);
        assert_eq!(faults, fault::SPEED_LIMITED | fault::ACCELERATION_LIMITED);
        for _ in 0..20 {
            guard.limit(Twist::new(9.0, -9.0));
        }
        let full = Twist::new(1.0, -1.0);
        assert_eq!(guard.limit(full), (full, 0));
        let (out, faults) = guard.limit(Twist::new(f32::NAN, 0.0));
        assert!(out.linear_mps < 1.0 && faults & fault::NON_FINITE != 0, "a ramp to zero, named");
        assert_eq!(guard.sent(), &[out, full], "what left, newest first");
        guard.restart_from(Twist::new(0.5, -0.25));
        assert_eq!(guard.sent(), &[Twist::new(0.5, -0.25); 2]);
    }
}
