//! A stage that is restored in the middle goes on to the bit.

use nav_env::worlds::{Place, generate_places};
use nav_sim::families::{Family, Split};
use std::sync::Arc;

use super::high_stage::HighStage;
use super::low_stage::LowStage;
use crate::acting::pack;
use crate::config::Config;

fn config() -> Config {
    let mut config = Config::default();
    (config.low.envs, config.low.batch, config.low.warmup_steps) = (4, 32, 400);
    (config.low.env_steps, config.low.replay_capacity) = (4_000, 1_000);
    (config.high.envs, config.high.batch, config.high.warmup_decisions) = (4, 32, 60);
    (config.high.decisions, config.high.replay_capacity) = (1_000, 150);
    config.low.td3.hidden = vec![16];
    config.high.dqn.hidden = vec![16];
    config
}

fn places() -> Arc<Vec<Place>> {
    Arc::new(generate_places(&[Family::Clutter, Family::Crowd], Split::Train, 0..3, 0.2))
}

fn bytes(state: &impl serde::Serialize) -> Vec<u8> {
    postcard::to_stdvec(state).expect("a state is plain data")
}

#[test]
fn a_restored_low_stage_goes_on_to_the_bit() {
    let config = config();
    let mut stage = LowStage::new(&config, places()).expect("a stage");
    let drive = |stage: &mut LowStage| (0..350).for_each(|_| stage.round().expect("it learns"));
    drive(&mut stage);
    assert!(stage.learner().updates() > 100 && stage.replay_rows().len() > 100);
    stage.scale_learning_rates(0.5);
    let (state, rows) = (bytes(&stage.state()), stage.replay_rows().to_vec());
    drive(&mut stage);
    let mut again = LowStage::new(&config, places()).expect("a stage");
    again.restore(postcard::from_bytes(&state).expect("whole"), rows).expect("it fits");
    assert_eq!(bytes(&again.state()), state, "what was saved is what is there");
    drive(&mut again);
    assert!(bytes(&again.state()) == bytes(&stage.state()), "the restored stage went another way");
    assert!(again.replay_rows() == stage.replay_rows());
}

#[test]
fn a_restored_high_stage_goes_on_to_the_bit() {
    let config = config();
    let low = LowStage::new(&config, places()).expect("a stage");
    let fresh = || {
        let acting = pack(low.learner().actor(), None, 1).expect("a small network");
        HighStage::new(&config, places(), acting).expect("a stage")
    };
    let mut stage = fresh();
    let drive = |stage: &mut HighStage| (0..60).for_each(|_| stage.round().expect("it learns"));
    drive(&mut stage);
    assert!(stage.learner().updates() > 20 && stage.replay_rows().len() > 100);
    stage.scale_learning_rate(0.5);
    let (state, rows) = (bytes(&stage.state()), stage.replay_rows().to_vec());
    drive(&mut stage);
    let mut again = fresh();
    again.restore(postcard::from_bytes(&state).expect("whole"), rows).expect("it fits");
    assert_eq!(bytes(&again.state()), state, "what was saved is what is there");
    drive(&mut again);
    assert!(bytes(&again.state()) == bytes(&stage.state()), "the restored stage went another way");
    assert!(again.replay_rows() == stage.replay_rows());
}
