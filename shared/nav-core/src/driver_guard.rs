//! The guard on the driver's side: what the base may be told, whatever the runtime does or no longer does.
//!
//! | command | what the base gets |
//! |---|---|
//! | fresh and finite | the command, within the limits of speed and acceleration |
//! | not finite | a ramp to zero |
//! | none for [`DriverGuard::stale_after_ns`] | a ramp to zero, until commands come again |

use crate::guard::command_age_limit_ns;
use crate::messages::CmdVel;
use crate::task::Task;
use crate::twist::Twist;

/// Between the newest command and the base: asked once a control period, by every driver.
#[derive(Clone, Debug)]
pub struct DriverGuard {
    task: Task,
    stale_after_ns: u64,
    command: CmdVel,
    received_ns: u64,
    last: Twist,
    stale_steps: u64,
}

impl DriverGuard {
    /// At rest, without a command.
    pub fn new(task: &Task) -> Self {
        let stale_after_ns = command_age_limit_ns(task.control_period_ns());
        Self {
            task: *task,
            stale_after_ns,
            command: CmdVel::default(),
            received_ns: 0,
            last: Twist::ZERO,
            stale_steps: 0,
        }
    }

    /// The age at which a command stops counting, ns.
    pub fn stale_after_ns(&self) -> u64 {
        self.stale_after_ns
    }

    /// Whether a command read at `now_ns`, of the clock that its stamp is of, is one to obey: newer than the last one,
    /// not held up on its way (a frozen runtime that wakes sends what it had decided long ago), and not from the
    /// future (after such a one, none would be newer).
    pub fn is_fresh(&self, command: &CmdVel, now_ns: u64) -> bool {
        let stamp_ns = command.header.stamp_ns;
        let age_ns = now_ns.checked_sub(stamp_ns);
        stamp_ns > self.command.header.stamp_ns && age_ns.is_some_and(|age_ns| age_ns <= self.stale_after_ns)
    }

    /// Takes a command that arrived at `now_ns`; true when it is newer than the last one.
    pub fn accept(&mut self, command: &CmdVel, now_ns: u64) -> bool {
        let newer = command.header != self.command.header;
        if newer {
            self.command = *command;
            self.received_ns = now_ns;
        }
        newer
    }

    /// What the base gets for the next period, at `now_ns` on the clock that [`Self::accept`] was told.
    pub fn target(&mut self, now_ns: u64) -> Twist {
        let fresh = self.command.header.is_received()
            && now_ns.saturating_sub(self.received_ns) <= self.stale_after_ns;
        self.stale_steps += u64::from(!fresh);
        let command = self.command.twist();
        let wish = if fresh && command.is_finite() { command } else { Twist::ZERO };
        let robot = &self.task.robot;
        // A hair more than the runtime's own limit, so that rounding never cuts what it let pass.
        self.last = robot.ramped(self.last, robot.limited(wish), self.task.control_period_s * 1.0001);
        self.last
    }

    /// A new episode: the robot stands, and commands meant for the last one do not count.
    pub fn restart(&mut self) {
        self.command = CmdVel { header: self.command.header, ..CmdVel::default() };
        self.last = Twist::ZERO;
        self.stale_steps = 0;
    }

    /// Periods of this episode without a fresh command.
    pub fn stale_steps(&self) -> u64 {
        self.stale_steps
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::Header;

    fn command(seq: u64, linear_mps: f32) -> CmdVel {
        CmdVel { header: Header { stamp_ns: 0, seq }, linear_mps, ..CmdVel::default() }
    }

    fn driving() -> DriverGuard {
        let mut driver = DriverGuard::new(&Task::default());
        for seq in 1..=10 {
            driver.accept(&command(seq, 1.0), 0);
            driver.target(0);
        }
        driver
    }

    #[test]
    fn speed_and_acceleration_are_limited() {
        let mut driver = DriverGuard::new(&Task::default());
        driver.accept(&command(1, 9.0), 0);
        // 2 m/s² for 0.1 s.
        assert!((driver.target(0).linear_mps - 0.2).abs() < 1e-3);
        assert!((driving().target(0).linear_mps - 1.0).abs() < 1e-6, "never above the limit");
    }

    #[test]
    fn only_a_robot_that_may_reverses() {
        for linear_min_mps in [0.0, -0.3] {
            let mut task = Task::default();
            task.robot.linear_min_mps = linear_min_mps;
            let mut driver = DriverGuard::new(&task);
            driver.accept(&command(1, -9.0), 0);
            assert!(
                (driver.target(0).linear_mps - linear_min_mps.max(-0.2)).abs() < 1e-3,
                "2 m/s² for 0.1 s"
            );
            assert!((driver.target(0).linear_mps - linear_min_mps).abs() < 1e-6, "{linear_min_mps}");
        }
    }

    #[test]
    fn a_stale_command_ramps_to_zero_and_a_new_one_drives_on() {
        let mut driver = driving();
        let late_ns = driver.stale_after_ns() + 1;
        assert!(driver.target(late_ns - 1).linear_mps > 0.99, "still fresh");
        let speeds: [f32; 8] = core::array::from_fn(|_| driver.target(late_ns).linear_mps);
        assert!(speeds[0] < 0.81 && speeds[0] > 0.7, "a ramp, not a jump: {speeds:?}");
        assert!(speeds[6].abs() < 1e-6, "{speeds:?}");
        assert_eq!(driver.stale_steps(), 8);
        driver.accept(&command(10, 1.0), late_ns);
        assert!(driver.target(late_ns).linear_mps.abs() < 1e-6, "the same command again is not new");
        driver.accept(&command(11, 1.0), late_ns);
        assert!(driver.target(late_ns).linear_mps > 0.1);
    }

    #[test]
    fn a_command_that_is_not_finite_ramps_to_zero() {
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let mut driver = driving();
            driver.accept(&command(11, bad), 0);
            let next = driver.target(0);
            assert!(next.linear_mps < 0.81 && next.linear_mps >= 0.0, "{bad}: {next:?}");
        }
        let mut turning = driving();
        turning.accept(&CmdVel { angular_radps: f32::NAN, ..command(11, 1.0) }, 0);
        assert!(turning.target(0).linear_mps < 0.81, "one bad number spoils the command");
    }

    #[test]
    fn the_stale_age_follows_the_period() {
        let with_period = |control_period_s: f32| {
            DriverGuard::new(&Task { control_period_s, ..Task::default() }).stale_after_ns() / 1_000_000
        };
        assert_eq!([0.01, 0.02, 0.05, 0.1].map(with_period), [50, 100, 125, 250]);
    }

    #[test]
    fn a_command_counts_by_its_own_stamp() {
        let stamped = |stamp_ns| CmdVel { header: Header { stamp_ns, seq: 12 }, ..command(0, 1.0) };
        let mut driver = driving();
        let age_ns = driver.stale_after_ns();
        driver.accept(&stamped(50), 60);
        assert!(driver.is_fresh(&stamped(51), 51) && driver.is_fresh(&stamped(51), 51 + age_ns));
        assert!(!driver.is_fresh(&stamped(51), 52 + age_ns), "held up on its way");
        assert!(!driver.is_fresh(&stamped(52), 51), "from the future");
        assert!(!driver.is_fresh(&stamped(50), 51), "not newer than the last one");
        driver.restart();
        assert!(!driver.is_fresh(&stamped(50), 51), "nor after a restart");
    }

    #[test]
    fn a_restart_stands_still() {
        let mut driver = driving();
        driver.restart();
        let first = driver.target(0);
        assert!(first.linear_mps.abs() < 1e-6, "{first:?}");
    }
}
