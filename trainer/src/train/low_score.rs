//! How a low level does on random subgoals, by family: the half of the gate that needs no high level. It drives behind the
//! safety gate, as it will: without it a fast robot's grazes are more than a slow one's, and none of the policy that ships.
//!
//! A random subgoal lies where the scan leaves room, which is more than there is: behind what a lidar of 180 degrees does
//! not see, through the hole that a lost beam leaves. No policy reaches what the map has no way to, so that reach is judged
//! over the subgoals that the static map has a way to, not much longer than the straight line. Collisions count with every
//! subgoal.

use nav_core::footprint::Footprint;
use nav_core::geometry::Point;
use nav_core::observation::LOW_ACTION;
use nav_env::ActingNetwork;
use nav_env::low::{Attempt, LowRobot, LowRobotConfig};
use nav_env::seeds::derive;
use nav_env::worlds::{Place, generate_places};
use nav_sim::families::{Family, Split};
use nav_sim::geodesic::GeodesicField;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

use crate::config::Config;

/// Attempts in each family. A share near 97 % of six times as many is known to 0.35 percentage points.
const ATTEMPTS: usize = 400;
/// Validation worlds of each family.
const WORLDS: u64 = 50;
/// A way may be so much longer than the straight line, as a factor: up to here a policy that sees no farther than its
/// lidar need not look for one.
const DETOUR_MAX: f32 = 1.5;
/// Robots that share the attempts.
const ROBOTS: u64 = 8;

/// How the low level does on random subgoals in static worlds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LowScore {
    /// Attempts at subgoals that can be reached.
    pub attempts: usize,
    /// Share of these that were reached.
    pub reach: f32,
    /// Share of all attempts that collided.
    pub collision: f32,
}

/// [`LowScore`] over all families, and of each.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LowReport {
    /// Over all families, each with equal weight.
    pub all: LowScore,
    /// Of each static family that the low level is trained on.
    pub families: Vec<(Family, LowScore)>,
}

impl std::fmt::Display for LowReport {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let LowScore { attempts, reach, collision } = self.all;
        let (reach, collision) = (100.0 * reach, 100.0 * collision);
        write!(f, "reaches {reach:.1} % of {attempts} random subgoals, collides in {collision:.1} %")?;
        for (place, (family, score)) in self.families.iter().enumerate() {
            let (reach, collision) = (100.0 * score.reach, 100.0 * score.collision);
            let before = if place == 0 { " (" } else { ", " };
            write!(f, "{before}{family} {reach:.1} and {collision:.1}")?;
        }
        if self.families.is_empty() { Ok(()) } else { f.write_str(")") }
    }
}

/// Drives greedily at random subgoals in validation worlds of every static family that the low level trains on, or of
/// clutter where it trains on none.
pub fn score_low(config: &Config, network: &mut ActingNetwork) -> LowReport {
    let mut families: Vec<_> =
        config.low.families.iter().copied().filter(|family| !family.has_people()).collect();
    if families.is_empty() {
        families.push(Family::Clutter);
    }
    let scores = families.into_iter().map(|family| (family, score_family(config, family, network)));
    let families: Vec<(Family, LowScore)> = scores.collect();
    let mean = |of: fn(&LowScore) -> f32| {
        families.iter().map(|(_, score)| of(score)).sum::<f32>() / families.len() as f32
    };
    let all = LowScore {
        attempts: families.iter().map(|(_, score)| score.attempts).sum(),
        reach: mean(|score| score.reach),
        collision: mean(|score| score.collision),
    };
    LowReport { all, families }
}

fn score_family(config: &Config, family: Family, network: &mut ActingNetwork) -> LowScore {
    let places =
        Arc::new(generate_places(&[family], Split::Validation, 0..WORLDS, &config.task.robot.footprint));
    let low = LowRobotConfig { goal_share: 0.0, ..config.low.robot() };
    let mut counts = Counts::default();
    for robot in 0..ROBOTS {
        let seed = derive(config.seed, 5_000 + robot);
        let robot = LowRobot::new(low, places.clone(), &config.task, &config.disturbance, seed);
        let mut robot = robot.behind_gate();
        // Each robot makes equally many, so that long attempts count as much as short ones.
        let mut left = ATTEMPTS / ROBOTS as usize;
        let mut begun = Begun::of(&robot);
        // Far more steps than they take: where no subgoal can be found, the score says so by too few attempts.
        for _ in 0..10 * left * config.task.ticks(config.low.subgoal_s) as usize {
            if left == 0 {
                break;
            }
            let mut action = [0.0; LOW_ACTION];
            network.run(robot.observation(), &mut action);
            let is_random = !robot.target_is_goal();
            let attempt = robot.step(action, &mut Vec::new()).attempt;
            if attempt == Attempt::Running {
                continue;
            }
            if is_random && attempt != Attempt::Cut {
                // Who has reached one has shown that it can be reached.
                let is_judged =
                    attempt == Attempt::Reached || begun.is_within_reach(&config.task.robot.footprint);
                counts.add(attempt, is_judged);
                left -= usize::from(is_judged);
            }
            begun = Begun::of(&robot);
        }
    }
    counts.score()
}

/// Where an attempt began, and what it was made at, world frame.
struct Begun {
    place: Place,
    from: Point,
    to: Point,
}

impl Begun {
    fn of(robot: &LowRobot) -> Self {
        let episode = robot.episode();
        let from = episode.simulation().pose().position();
        Self { place: episode.place().clone(), from, to: robot.true_target() }
    }

    /// Whether the static map has a way there, not much longer than the straight line.
    fn is_within_reach(&self, footprint: &Footprint) -> bool {
        let field = GeodesicField::towards(&self.place.world, self.to, footprint);
        let straight_m = (self.to - self.from).norm();
        field.distance_m(self.from).is_some_and(|way_m| way_m <= DETOUR_MAX * straight_m)
    }
}

/// How attempts ended.
#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    all: usize,
    judged: usize,
    reached: usize,
    collided: usize,
}

impl Counts {
    fn add(&mut self, attempt: Attempt, is_judged: bool) {
        self.all += 1;
        self.judged += usize::from(is_judged);
        self.reached += usize::from(attempt == Attempt::Reached);
        self.collided += usize::from(attempt == Attempt::Collided);
    }

    fn score(self) -> LowScore {
        LowScore {
            attempts: self.judged,
            reach: self.reached as f32 / self.judged as f32,
            collision: self.collided as f32 / self.all as f32,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nav_core::geometry::Pose;
    use nav_sim::world::{Bounds, Segment, World};

    const ROBOT: Footprint = Footprint::circle(0.2);

    #[test]
    fn words_name_the_whole_and_each_family() {
        let score = LowScore { attempts: 400, reach: 0.97, collision: 0.0125 };
        let report = LowReport {
            all: LowScore { attempts: 800, reach: 0.98, ..score },
            families: vec![(Family::Clutter, LowScore { reach: 0.99, ..score }), (Family::Maze, score)],
        };
        assert_eq!(
            report.to_string(),
            "reaches 98.0 % of 800 random subgoals, collides in 1.2 % (clutter 99.0 and 1.2, maze 97.0 and 1.2)"
        );
        assert_eq!(LowReport::default().to_string(), "reaches 0.0 % of 0 random subgoals, collides in 0.0 %");
    }

    #[test]
    fn reach_is_judged_over_what_can_be_reached_and_collisions_over_everything() {
        let mut counts = Counts::default();
        for (attempt, is_judged) in [
            (Attempt::Reached, true),
            (Attempt::GivenUp, true),
            (Attempt::GivenUp, false),
            (Attempt::Collided, false),
        ] {
            counts.add(attempt, is_judged);
        }
        assert_eq!(counts.score(), LowScore { attempts: 2, reach: 0.5, collision: 0.25 });
    }

    #[test]
    fn a_subgoal_behind_a_wall_that_the_lidar_does_not_see_is_not_within_reach() {
        let wall = Segment { a: Point::new(5.0, 0.0), b: Point::new(5.0, 9.0) };
        let world = World {
            name: "test".into(),
            bounds: Bounds { min: Point::origin(), max: Point::new(10.0, 10.0) },
            discs: Vec::new(),
            segments: vec![wall],
            polygons: Vec::new(),
            people: Vec::new(),
            start: Pose::new(4.0, 5.0, 0.0),
            goal: Point::new(1.0, 1.0),
        };
        let place = Place::read("test", Arc::new(world), 0, &ROBOT);
        let is_within_reach = |x, y| {
            Begun { place: place.clone(), from: Point::new(4.0, 5.0), to: Point::new(x, y) }
                .is_within_reach(&ROBOT)
        };
        // Here, behind the wall (a way of 9 m leads there), in the wall, outside.
        assert_eq!(
            [(3.0, 7.0), (6.0, 5.0), (5.0, 5.0), (4.0, 12.0)].map(|(x, y)| is_within_reach(x, y)),
            [true, false, false, false]
        );
    }
}
