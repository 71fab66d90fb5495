//! The guard: what may leave for the base. Stale, impossible or non-finite input stops the robot in the same tick, and
//! says why ([`Cause`]); speed and acceleration are limited always, also while stopping.

mod cause;
mod odom_watch;

pub use self::cause::{Cause, Input};

use self::odom_watch::OdomWatch;
use crate::messages::{Goal, Header, LaserScan, Odometry, fault};
use crate::scan::SECTOR_COUNT;
use crate::sent::Sent;
use crate::task::Task;
use crate::twist::Twist;

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

/// Beyond 100 km a float has no centimetres left, m.
const FAR_M: f32 = 1e5;

/// Between the policy and the base: judges what comes in, limits what goes out.
#[derive(Clone, Debug)]
pub struct Guard {
    task: Task,
    /// A goal older than this is stale, ns; none for goals that are sent once.
    goal_age_limit_ns: Option<u64>,
    sent: Sent,
    /// What the next ramp starts from: the last command, or nearer to zero when nobody knows.
    ramp_from: Twist,
    last_scan: Header,
    last_odom: Header,
    odom_watch: OdomWatch,
}

impl Guard {
    /// At a standstill.
    pub fn new(task: &Task) -> Self {
        Self {
            task: *task,
            goal_age_limit_ns: None,
            sent: Sent::default(),
            ramp_from: Twist::ZERO,
            last_scan: Header::default(),
            last_odom: Header::default(),
            odom_watch: OdomWatch::new(task.robot),
        }
    }

    /// Goals are to be repeated: one that is older than this is stale, ns. Without it a goal sent once counts for ever.
    pub fn set_goal_age_limit_ns(&mut self, limit_ns: Option<u64>) {
        self.goal_age_limit_ns = limit_ns;
    }

    /// What is wrong with the inputs at `now_ns`, as [`fault`] bits, and the first thing that needs words.
    pub fn inspect(
        &mut self,
        now_ns: u64,
        scan: &LaserScan,
        odom: &Odometry,
        goal: &Goal,
    ) -> (u32, Option<Cause>) {
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
        let stale_goal = self.stale_goal(now_ns, goal);
        let clock = self.clock(now_ns, scan, odom, goal);
        let number = odd_number(odom, goal);
        let impossible = self.odom_watch.inspect(odom, goal);
        for (bit, cause) in [
            (fault::STALE_GOAL, &stale_goal),
            (fault::BAD_CLOCK, &clock),
            (fault::BAD_INPUT, &number),
            (fault::BAD_ODOM, &impossible),
        ] {
            faults |= if cause.is_some() { bit } else { 0 };
        }
        let uncounted = [(Input::Scan, scan.header), (Input::Odom, odom.header), (Input::Goal, goal.header)]
            .into_iter()
            .find(|(_, header)| header.seq == 0 && header.stamp_ns != 0)
            .map(|(input, _)| Cause::NoSequence(input));
        (faults, uncounted.or(clock).or(number).or(impossible).or(stale_goal))
    }

    fn stale_goal(&self, now_ns: u64, goal: &Goal) -> Option<Cause> {
        let (limit_ns, age_ns) = (self.goal_age_limit_ns?, goal.header.age_ns(now_ns));
        let seconds = |ns: u64| ns as f32 / 1e9;
        (goal.header.is_received() && age_ns > limit_ns)
            .then(|| Cause::StaleGoal { age_s: seconds(age_ns), limit_s: seconds(limit_ns) })
    }

    fn clock(&mut self, now_ns: u64, scan: &LaserScan, odom: &Odometry, goal: &Goal) -> Option<Cause> {
        let headers = [(Input::Scan, scan.header), (Input::Odom, odom.header), (Input::Goal, goal.header)];
        let future = headers
            .into_iter()
            .find(|(_, header)| header.is_from_future(now_ns))
            .map(|(input, header)| Cause::Future { input, by_ns: header.stamp_ns - now_ns });
        let backwards =
            [(Input::Scan, self.last_scan, scan.header), (Input::Odom, self.last_odom, odom.header)]
                .into_iter()
                .find(|(_, last, now)| runs_backwards(*last, *now))
                .map(|(input, last, now)| Cause::Backwards {
                    input,
                    seq: (last.seq, now.seq),
                    stamp_ns: (last.stamp_ns, now.stamp_ns),
                });
        (self.last_scan, self.last_odom) = (scan.header, odom.header);
        future.or(backwards)
    }

    /// Takes in what left in a tick that drove, and the sectors seen in it, m: odometry must agree.
    pub fn note_drive(&mut self, now_ns: u64, out: Twist, sectors_m: &[f32; SECTOR_COUNT]) {
        self.odom_watch.note(now_ns, out, sectors_m);
    }

    /// Cuts a wish to the limits of speed and acceleration, a control period after the last one; see
    /// [`Self::limit_after`].
    pub fn limit(&mut self, wish: Twist) -> (Twist, u32) {
        self.limit_after(self.task.control_period_s, wish)
    }

    /// Cuts a wish to the limits of speed and acceleration, `passed_s` after the last one (a period counts at most: what
    /// was not commanded was not driven); a wish that is not finite is zero. Returns what may leave, and why it differs
    /// as [`fault`] bits.
    pub fn limit_after(&mut self, passed_s: f32, wish: Twist) -> (Twist, u32) {
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
        let out = robot.ramped(self.ramp_from, speed, passed_s.clamp(0.0, self.task.control_period_s));
        if out != speed {
            faults |= fault::ACCELERATION_LIMITED;
        }
        self.sent.push(out);
        self.ramp_from = out;
        (out, faults)
    }

    /// Starts afresh where the base was measured to move like this: after a pause, or with a first goal. The policy sees
    /// the measurement; the ramp starts from it only downwards from what was commanded last, because a speed sensor that
    /// is stuck must not let a standing robot jump. After `silent_ns` for which a base no longer obeys
    /// ([`command_age_limit_ns`]), it starts from zero.
    pub fn restart_from(&mut self, measured: Twist, silent_ns: u64) {
        let measured = self.task.robot.limited(measured);
        let is_obeyed = silent_ns <= command_age_limit_ns(self.task.control_period_ns());
        let commanded = if is_obeyed { self.ramp_from } else { Twist::ZERO };
        self.sent = Sent::of(&[measured]);
        self.ramp_from = Twist::new(
            nearer_to_zero(commanded.linear_mps, measured.linear_mps),
            nearer_to_zero(commanded.angular_radps, measured.angular_radps),
        );
    }

    /// What the next ramp starts from.
    pub fn ramp_from(&self) -> Twist {
        self.ramp_from
    }

    /// The last commands that left; after a restart, what the base was measured to do.
    pub fn sent(&self) -> &Sent {
        &self.sent
    }
}

/// The first number that is not finite or too large, or a radius that is none.
fn odd_number(odom: &Odometry, goal: &Goal) -> Option<Cause> {
    let numbers = [
        (Input::Odom, "x", odom.pose.x_m),
        (Input::Odom, "y", odom.pose.y_m),
        (Input::Odom, "yaw", odom.pose.yaw_rad),
        (Input::Odom, "the forward speed", odom.linear_mps),
        (Input::Odom, "the turning rate", odom.angular_radps),
        (Input::Goal, "x", goal.x_m),
        (Input::Goal, "y", goal.y_m),
        (Input::Goal, "the radius", goal.radius_m),
    ];
    let is_odd = |field, value: f32| {
        !value.is_finite()
            || value.abs() > FAR_M
            || (field == "the radius" && goal.header.is_received() && value <= 0.0)
    };
    numbers
        .into_iter()
        .find(|(_, field, value)| is_odd(*field, *value))
        .map(|(input, field, found)| Cause::Number { input, field, found })
}

/// Whether sequence or time went back, or one of them stood still while the other went on.
fn runs_backwards(last: Header, now: Header) -> bool {
    now.seq < last.seq
        || now.stamp_ns < last.stamp_ns
        || (now.seq == last.seq) != (now.stamp_ns == last.stamp_ns)
}

/// The smaller of two numbers of the same sign; 0 for two of different signs.
fn nearer_to_zero(a: f32, b: f32) -> f32 {
    if a * b <= 0.0 {
        0.0
    } else if a.abs() < b.abs() {
        a
    } else {
        b
    }
}

#[cfg(test)]
mod tests;
