//! The way from the last command to zero.

use nav_core::guard::command_age_limit_ns;
use nav_core::messages::{CmdVel, RunState};
use nav_core::task::Task;
use nav_core::twist::Twist;

/// The last command that was sent, and how to come to rest from it.
#[derive(Clone, Copy, Debug)]
pub struct Rest {
    last: CmdVel,
    sent_ns: u64,
    period_ns: u64,
    /// Change in a period that the robot is allowed.
    change: Twist,
}

impl Rest {
    /// Before the first command.
    pub fn new(task: &Task, period_ns: u64) -> Self {
        let (robot, period_s) = (&task.robot, period_ns as f32 / 1e9);
        let change = Twist::new(
            robot.linear_acceleration_mps2 * period_s,
            robot.angular_acceleration_radps2 * period_s,
        );
        Self { last: CmdVel::default(), sent_ns: 0, period_ns, change }
    }

    /// A command left at `now_ns`.
    pub fn note(&mut self, command: &CmdVel, now_ns: u64) {
        (self.last, self.sent_ns) = (*command, now_ns);
    }

    /// Whether any command was ever sent.
    pub fn has_begun(&self) -> bool {
        self.last.header.is_received()
    }

    /// Whether the last command was zero.
    pub fn is_reached(&self) -> bool {
        self.last.twist() == Twist::ZERO
    }

    /// The next command towards zero: within the acceleration limits, or zero at once if `at_once`. Zero also when the
    /// last command no longer counts for the base: the robot stands by then, and a ramp would set it in motion again.
    pub fn next(&self, now_ns: u64, at_once: bool) -> CmdVel {
        let silent_ns = now_ns.saturating_sub(self.sent_ns);
        let at_once = at_once || silent_ns > command_age_limit_ns(self.period_ns);
        let change = if at_once { Twist::new(f32::MAX, f32::MAX) } else { self.change };
        let mut command = self.last;
        command.linear_mps = towards_zero(command.linear_mps, change.linear_mps);
        command.angular_radps = towards_zero(command.angular_radps, change.angular_radps);
        command.state = RunState::Ready as u32;
        command.header.seq += 1;
        // A stamp goes on with the time that passed, whichever clock the last one was of.
        command.header.stamp_ns = command.header.stamp_ns.saturating_add(silent_ns.max(1));
        command
    }
}

fn towards_zero(value: f32, change: f32) -> f32 {
    if value.is_finite() { value - value.clamp(-change, change) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nav_core::messages::Header;

    const PERIOD_NS: u64 = 100_000_000;

    fn driving(linear_mps: f32) -> Rest {
        let mut rest = Rest::new(&Task::default(), PERIOD_NS);
        let header = Header { stamp_ns: 7, seq: 3 };
        rest.note(&CmdVel { header, linear_mps, angular_radps: 0.1, ..CmdVel::default() }, 1000);
        rest
    }

    #[test]
    fn a_ramp_keeps_the_limits_and_goes_on_counting() {
        let mut rest = driving(0.5);
        let mut now_ns = 1000;
        let mut speeds = Vec::new();
        while !rest.is_reached() {
            now_ns += PERIOD_NS;
            let before = rest.last.header;
            let command = rest.next(now_ns, false);
            rest.note(&command, now_ns);
            assert_eq!(command.header.seq, before.seq + 1);
            assert_eq!(command.header.stamp_ns, before.stamp_ns + PERIOD_NS);
            speeds.push((command.linear_mps * 100.0).round() as i32);
        }
        // 2 m/s² for 0.1 s.
        assert_eq!(speeds, [30, 10, 0]);
    }

    #[test]
    fn it_is_zero_at_once_after_a_silence_also_within_a_ramp() {
        let mut rest = driving(0.8);
        assert!(rest.next(1000 + 2 * PERIOD_NS, false).linear_mps > 0.5);
        assert!(rest.next(1000 + 3 * PERIOD_NS, false).linear_mps.abs() < 1e-9);
        assert!(rest.next(1000, true).linear_mps.abs() < 1e-9);
        rest.note(&rest.next(1000 + PERIOD_NS, false), 1000 + PERIOD_NS);
        assert!(rest.next(1000 + 9 * PERIOD_NS, false).linear_mps.abs() < 1e-9, "frozen on the way down");
    }

    #[test]
    fn a_command_that_is_not_finite_is_followed_by_zero() {
        assert!(driving(f32::NAN).next(1001, false).linear_mps.abs() < 1e-9);
    }
}
