//! A stage that is restored in the middle goes on to the bit, whichever stages came before.

use nav_sim::families::Family;

use super::learners::Learners;
use super::plan::{Learns, StagePlan, stages};
use super::stage::Stage;
use crate::checkpoint::{Checkpoint, Contents};
use crate::config::Config;

fn config() -> Config {
    let mut config = Config { worlds_per_family: 3, ..Config::default() };
    (config.low.envs, config.low.batch, config.low.warmup_steps) = (4, 32, 400);
    (config.low.env_steps, config.low.replay_capacity) = (2_800, 1_000);
    (config.high.envs, config.high.batch, config.high.warmup_decisions) = (4, 32, 60);
    (config.high.decisions, config.high.replay_capacity) = (480, 150);
    config.low.families = vec![Family::Clutter, Family::Crowd];
    config.high.families = config.low.families.clone();
    config.low.td3.hidden = vec![16];
    config.high.dqn.hidden = vec![16];
    config
}

/// A checkpoint's bytes.
fn snapshot(stage: &dyn Stage, learners: &Learners) -> Vec<u8> {
    let (mut contents, mut bytes) = (Contents::new(), Vec::new());
    learners.add_to(&mut contents).expect("a state is plain data");
    stage.add_to(&mut contents).expect("a state is plain data");
    contents.write_to(0, &mut bytes).expect("memory can be written");
    bytes
}

fn checkpoint(bytes: &[u8]) -> Checkpoint {
    let file = tempfile::NamedTempFile::new().expect("a temporary file");
    std::fs::write(file.path(), bytes).expect("the disk has room");
    Checkpoint::load(file.path()).expect("whole")
}

#[test]
fn every_stage_of_a_list_goes_on_to_the_bit_after_a_restore() {
    let config = config();
    let mut stages = stages(&config, false, &[]);
    // No run has this one yet: the low level learns on, in the same buffer, after the high level has learned above it.
    stages.push(StagePlan { streams: [6_000, 7_000], ..stages[0].clone() });
    assert_eq!(
        stages.iter().map(|plan| plan.learns).collect::<Vec<_>>(),
        [Learns::Low, Learns::High, Learns::Low]
    );
    let mut learners = Learners::new(&config, None).expect("small networks");
    let mut updates = 0;
    for (index, plan) in stages.iter().enumerate() {
        let rounds = plan.budget as usize / plan.robots / 2;
        let drive = |stage: &mut dyn Stage, learners: &mut Learners| {
            (0..rounds).for_each(|_| stage.round(learners).expect("it learns"));
        };
        let mut stage = plan.begin(&config);
        learners.rest(&stages[index..]);
        drive(stage.as_mut(), &mut learners);
        learners.slow_down(plan.learns, 0.5);
        let saved = snapshot(stage.as_ref(), &learners);
        drive(stage.as_mut(), &mut learners);
        assert!(stage.is_finished());

        let mut again = plan.begin(&config);
        let mut others = Learners::new(&config, None).expect("small networks");
        others.rest(&stages[index..]);
        let mut checkpoint = checkpoint(&saved);
        others.restore_from(&mut checkpoint).expect("it fits");
        again.restore_from(&checkpoint, &mut others).expect("it fits");
        assert!(snapshot(again.as_ref(), &others) == saved, "{}: what was saved is what is there", plan.name);
        drive(again.as_mut(), &mut others);
        let both = [snapshot(again.as_ref(), &others), snapshot(stage.as_ref(), &learners)];
        assert!(both[0] == both[1], "{}: the restored stage went another way", plan.name);

        assert!(learners.updates() > updates + 100, "{}: it learned", plan.name);
        updates = learners.updates();
    }
    let rows = learners.high.as_ref().map(|high| high.replay_rows().len());
    assert_eq!(rows, Some(0), "what no later stage trains has given its memory back");
    assert!(learners.low.replay_rows().len() > 100);
}
