//! What helps to find a mistake: the first message of each topic, and each decision with its reason. The loop hands it over
//! in memory of fixed size; another thread makes words of it.

use nav_core::messages::Header;
use nav_core::navigator::DecisionReason;
use nav_core::tick::{Inputs, TickStatus};
use std::fmt;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};
use std::sync::{Mutex, PoisonError};

/// Facts that may wait: more than a second of decisions at any rate but that of a fast lock-step.
const WAITING_MAX: usize = 256;

/// One of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fact {
    /// The first scan.
    Scan {
        /// Beams.
        beams: u32,
        /// Direction of the first and step to the next, rad.
        angles_rad: [f32; 2],
        /// Shortest and longest valid range, m.
        range_m: [f32; 2],
        /// Time and order.
        header: Header,
    },
    /// The first odometry.
    Odometry {
        /// x, y and yaw, m and rad.
        pose: [f32; 3],
        /// m/s and rad/s.
        velocity: [f32; 2],
        /// Time and order.
        header: Header,
    },
    /// The first goal, or another one.
    Goal {
        /// Its number.
        id: u32,
        /// x, y and radius, m.
        place_m: [f32; 3],
        /// Time and order.
        header: Header,
    },
    /// A decision of the high level.
    Decision {
        /// The number of its tick.
        tick: u64,
        /// Why now.
        reason: DecisionReason,
        /// What was chosen.
        action: usize,
        /// Where to, `odom` frame, m.
        subgoal_m: (f32, f32),
        /// How far the goal is, m.
        goal_distance_m: f32,
    },
    /// So many found no room.
    Lost(u64),
}

impl fmt::Display for Fact {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Scan { beams, angles_rad: [first_rad, step_rad], range_m: [min_m, max_m], header } => {
                write!(
                    f,
                    "first scan: {beams} beams from {first_rad:.4} rad on, one every {step_rad:.5} rad, {min_m} to {max_m} m{}",
                    Stamp(header)
                )
            }
            Self::Odometry { pose: [x_m, y_m, yaw_rad], velocity: [mps, radps], header } => write!(
                f,
                "first odometry: at {x_m:.2}, {y_m:.2} m, yaw {yaw_rad:.2} rad, {mps:.2} m/s, {radps:.2} rad/s{}",
                Stamp(header)
            ),
            Self::Goal { id, place_m: [x_m, y_m, radius_m], header } => {
                write!(f, "goal {id}: at {x_m:.2}, {y_m:.2} m, reached within {radius_m} m{}", Stamp(header))
            }
            Self::Decision { tick, reason, action, subgoal_m: (x_m, y_m), goal_distance_m } => write!(
                f,
                "tick {tick}: decided ({reason:?}): action {action}, subgoal {x_m:.2}, {y_m:.2} m; {goal_distance_m:.1} m to the goal"
            ),
            Self::Lost(count) => write!(f, "({count} more, faster than they could be told)"),
        }
    }
}

struct Stamp<'a>(&'a Header);

impl fmt::Display for Stamp<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, " (seq {}, stamp {:.3} s)", self.0.seq, self.0.stamp_ns as f64 / 1e9)
    }
}

/// Between the loop and the thread that tells.
#[derive(Debug, Default)]
pub struct Facts {
    waiting: Mutex<heapless::Deque<Fact, WAITING_MAX>>,
    lost: AtomicU64,
    has_scan: AtomicBool,
    has_odometry: AtomicBool,
    /// Number of the newest goal, plus one.
    goal: AtomicU64,
}

impl Facts {
    /// Takes in a tick. Neither waits nor allocates.
    pub fn meet(&self, tick: u64, inputs: &Inputs<'_>, status: &TickStatus) {
        let Inputs { scan, odom, goal } = inputs;
        if scan.header.is_received() && !self.has_scan.swap(true, Relaxed) {
            self.push(Fact::Scan {
                beams: scan.beam_count,
                angles_rad: [scan.angle_min_rad, scan.angle_increment_rad],
                range_m: [scan.range_min_m, scan.range_max_m],
                header: scan.header,
            });
        }
        if odom.header.is_received() && !self.has_odometry.swap(true, Relaxed) {
            let pose = &odom.pose;
            self.push(Fact::Odometry {
                pose: [pose.x_m, pose.y_m, pose.yaw_rad],
                velocity: [odom.linear_mps, odom.angular_radps],
                header: odom.header,
            });
        }
        let number = u64::from(goal.id) + 1;
        if goal.header.is_received() && self.goal.swap(number, Relaxed) != number {
            self.push(Fact::Goal {
                id: goal.id,
                place_m: [goal.x_m, goal.y_m, goal.radius_m],
                header: goal.header,
            });
        }
        if let Some(reason) = status.decided {
            self.push(Fact::Decision {
                tick,
                reason,
                action: status.action,
                subgoal_m: status.subgoal_m,
                goal_distance_m: status.goal_distance_m,
            });
        }
    }

    fn push(&self, fact: Fact) {
        let is_told = self.waiting.try_lock().is_ok_and(|mut waiting| waiting.push_back(fact).is_ok());
        if !is_told {
            self.lost.fetch_add(1, Relaxed);
        }
    }

    /// The oldest that was not told yet.
    pub fn next(&self) -> Option<Fact> {
        let oldest = self.waiting.lock().unwrap_or_else(PoisonError::into_inner).pop_front();
        oldest.or_else(|| match self.lost.swap(0, Relaxed) {
            0 => None,
            count => Some(Fact::Lost(count)),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nav_core::messages::{Goal, LaserScan, Odometry};

    #[test]
    fn first_messages_and_decisions_are_told_once_and_what_is_lost_is_counted() {
        let facts = Facts::default();
        let header = Header { stamp_ns: 1_500_000_000, seq: 7 };
        let scan = LaserScan { header, beam_count: 72, angle_increment_rad: 0.0873, ..LaserScan::default() };
        let (odom, none) = (Odometry { header, ..Odometry::default() }, Goal::default());
        let status =
            TickStatus { decided: Some(DecisionReason::Blocked), action: 5, ..TickStatus::default() };
        for tick in 1..=300 {
            facts.meet(tick, &Inputs { scan: &scan, odom: &odom, goal: &none }, &status);
        }
        let told: Vec<String> = std::iter::from_fn(|| facts.next()).map(|fact| fact.to_string()).collect();
        assert!(told[0].contains("72 beams") && told[0].contains("(seq 7, stamp 1.500 s)"), "{}", told[0]);
        assert!(told[1].contains("first odometry"), "{}", told[1]);
        assert!(told[2].contains("tick 1: decided (Blocked): action 5"), "{}", told[2]);
        assert_eq!(told.len(), WAITING_MAX + 1);
        assert!(told[WAITING_MAX].contains("46 more"), "302 facts for 256 places: {}", told[WAITING_MAX]);
        let goal = |id| Goal { header, id, ..Goal::default() };
        for goal in [goal(0), goal(0), goal(1)] {
            facts.meet(1, &Inputs { scan: &scan, odom: &odom, goal: &goal }, &TickStatus::default());
        }
        let told: Vec<String> = std::iter::from_fn(|| facts.next()).map(|fact| fact.to_string()).collect();
        assert!(told.len() == 2 && told[0].contains("goal 0") && told[1].contains("goal 1"), "{told:?}");
    }
}
