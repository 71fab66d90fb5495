//! The loop of an episode, for everything that judges: evaluation in one process, the simulator behind its topics,
//! and the tests that compare the two.
//!
//! | step | what happens |
//! |---|---|
//! | 1 | whoever commands sees the present moment and answers ([`Commands::exchange`]) |
//! | 2 | the simulation drives for one control period |
//! | 3 | the recorder takes in the truth; onlookers see it ([`Onlooker`]) |
//!
//! It ends as the simulation says; [`end_of`] is the one translation into what metrics and reports call it.

use nav_core::messages::RunState;
use nav_core::metrics::{EpisodeEnd, EpisodeMetrics, EpisodeRecorder, StepTruth};
use nav_core::twist::Twist;
use nav_sim::simulation::{Outcome, Simulation};

use crate::worlds::Place;

/// What answers a moment's messages.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    /// What the base gets for the next period.
    pub command: Twist,
    /// What the controller was doing when it commanded that.
    pub state: RunState,
}

/// Where commands come from.
pub trait Commands {
    /// Why there may be none.
    type Error;

    /// Shows the simulation's present moment, and returns the answer to it.
    ///
    /// # Errors
    /// Whatever ends the episode early.
    fn exchange(&mut self, simulation: &mut Simulation, goal_id: u32) -> Result<Answer, Self::Error>;
}

/// Whoever looks on, to draw or to keep what the metrics do not.
pub trait Onlooker<C> {
    /// A command was given and is not yet driven.
    fn commanded(&mut self, _simulation: &Simulation, _commands: &C) {}

    /// It was driven; the simulation knows how the episode stands.
    fn driven(&mut self, _simulation: &Simulation, _commands: &C) {}
}

/// Nobody.
impl<C> Onlooker<C> for () {}

/// Drives a simulation that stands at the start of `place` to the end of its episode.
///
/// # Errors
/// That of the commands.
pub fn drive_episode<C: Commands>(
    simulation: &mut Simulation,
    place: &Place,
    goal_id: u32,
    commands: &mut C,
    onlooker: &mut impl Onlooker<C>,
) -> Result<EpisodeMetrics, C::Error> {
    let mut recorder = EpisodeRecorder::new(simulation.pose(), place.world.goal, simulation.task());
    let end = loop {
        let answer = commands.exchange(simulation, goal_id)?;
        onlooker.commanded(simulation, commands);
        let outcome = simulation.step(answer.command);
        recorder.step(&StepTruth {
            pose: simulation.pose(),
            linear_mps: simulation.velocity().linear_mps,
            clearance_m: simulation.clearance_m(),
            time_to_collision_s: simulation.time_to_collision_s(),
        });
        onlooker.driven(simulation, commands);
        if let Some(end) = end_of(outcome, answer.state) {
            break end;
        }
    };
    Ok(recorder.finish(end, simulation.hit_while_standing(), place.geodesic_m()))
}

/// How an episode ended, given what the controller said it did last; `None` while it goes on.
pub fn end_of(outcome: Outcome, state: RunState) -> Option<EpisodeEnd> {
    match outcome {
        Outcome::Running => None,
        Outcome::Reached => Some(EpisodeEnd::Success),
        Outcome::Collided => Some(EpisodeEnd::Collision),
        Outcome::TimedOut if state == RunState::Reached => Some(EpisodeEnd::BelievedArrived),
        Outcome::TimedOut => Some(EpisodeEnd::Timeout),
    }
}
