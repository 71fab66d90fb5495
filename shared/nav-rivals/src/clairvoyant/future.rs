//! How everybody walks on while the robot carries out given commands: what the simulation will do, to the bit.

use nav_core::geometry::Point;
use nav_core::twist::Twist;
use nav_sim::body::Body;
use nav_sim::people::RobotState;
use nav_sim::simulation::Simulation;

/// How the commands end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    /// At the goal.
    Reached,
    /// In a collision, after so many whole steps.
    Collided(usize),
    /// They do not end the episode.
    Open,
}

/// Everybody's positions after each substep from now on.
pub(super) struct Future {
    people: usize,
    steps: usize,
    positions: Vec<Point>,
    pub(super) verdict: Verdict,
}

impl Future {
    /// Rolls on for so many steps. After the commands the robot is told to stand. People are followed beyond a
    /// collision, too, as if they could walk through the robot.
    pub(super) fn of(truth: &Simulation, commands: &[Twist], steps: usize) -> Self {
        let (mut base, mut crowd) = (truth.base().clone(), truth.crowd().clone());
        let (world, task, footprint) = (truth.world(), truth.task(), truth.footprint());
        let people = crowd.people().len();
        let mut future = Self { people, steps, positions: Vec::new(), verdict: Verdict::Open };
        future.positions.reserve(steps * base.substeps() as usize * people);
        for step in 0..steps {
            let robot = RobotState {
                position: base.pose().position(),
                velocity: base.velocity_in_world(),
                radius_m: footprint.circumradius_m(),
            };
            crowd.decide(&world.people, robot, truth.obstacles(), task.control_period_s);
            base.command(commands.get(step).copied().unwrap_or(Twist::ZERO));
            for _ in 0..base.substeps() {
                base.advance();
                crowd.advance(base.substep_s());
                future.positions.extend(crowd.people().iter().map(|person| person.position));
                let body = Body::new(footprint, base.pose());
                if future.verdict != Verdict::Open || step >= commands.len() {
                    continue;
                }
                if crowd.people().iter().any(|person| body.touches_disc(&person.disc(), 0.0))
                    || truth.obstacles().touches(&body)
                {
                    future.verdict = Verdict::Collided(step);
                } else if (world.goal - body.position()).norm() <= task.goal_radius_m {
                    future.verdict = Verdict::Reached;
                }
            }
        }
        future
    }

    /// Steps without a collision.
    pub(super) fn lasts(&self) -> usize {
        match self.verdict {
            Verdict::Collided(step) => step,
            Verdict::Reached | Verdict::Open => self.steps,
        }
    }

    /// Everybody's centres after a substep, counted from 0.
    pub(super) fn after(&self, substep: usize) -> &[Point] {
        &self.positions[substep * self.people..][..self.people]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nav_core::task::Task;
    use nav_sim::disturbance::Disturbance;
    use nav_sim::families::{Family, Split, generate};
    use nav_sim::simulation::Outcome;
    use std::sync::Arc;

    /// The robot drives in a circle among people, of whom some see it, until it hits one or the time is over.
    #[test]
    fn what_is_foreseen_comes_true_to_the_bit() {
        let mut collisions = 0;
        for seed in 0..6 {
            let world = Arc::new(generate(Family::Crowd, Split::Validation, seed));
            let mut truth = Simulation::new(world, &Task::default(), &Disturbance::usual(), seed);
            // From the middle of an episode: with commands on their way and people on theirs.
            for _ in 0..10 {
                truth.step(Twist::new(0.3, 1.0));
            }
            let commands = vec![Twist::new(0.6, 0.4); 60];
            let future = Future::of(&truth, &commands, commands.len());
            let substeps = truth.base().substeps() as usize;
            let mut verdict = Verdict::Open;
            for (step, &command) in commands.iter().enumerate() {
                match truth.step(command) {
                    Outcome::Running => {}
                    Outcome::Collided => verdict = Verdict::Collided(step),
                    end => panic!("{end:?} in a circle"),
                }
                if verdict != Verdict::Open {
                    break;
                }
                let foreseen = future.after((step + 1) * substeps - 1);
                let people: Vec<_> = truth.people().iter().map(|person| person.position).collect();
                assert_eq!(foreseen, people, "step {step} of world {seed}");
            }
            assert_eq!(future.verdict, verdict, "world {seed}");
            collisions += u32::from(verdict != Verdict::Open);
        }
        assert!((1..6).contains(&collisions), "{collisions} of 6 end in a collision: nothing is compared");
    }
}
