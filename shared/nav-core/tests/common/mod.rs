//! Controllers with small fixed networks, and messages of a made-up drive.
#![allow(dead_code, reason = "each test binary uses a part")]

use nav_core::controller::Controller;
use nav_core::geometry::Pose;
use nav_core::messages::{Goal, Header, LaserScan, Odometry};
use nav_core::network::{Activation, CpuLevel, Layer, MlpSpec, MlpWeights, Network};
use nav_core::observation::{CANDIDATE_FEATURES, LOW_ACTION, LOW_OBSERVATION};
use nav_core::task::{ACTION_COUNT, Task};

pub(crate) const PERIOD_NS: u64 = 100_000_000;

/// One layer of weights that follow from `seed`; `bad` puts a NaN among them.
pub(crate) fn network(inputs: usize, outputs: usize, rows: usize, seed: u32, bad: bool) -> Network<Vec<f32>> {
    let mut state = seed;
    let mut weights: Vec<f32> = (0..inputs * outputs)
        .map(|_| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32 - 0.5
        })
        .collect();
    if bad {
        weights[0] = f32::NAN;
    }
    of_weights(inputs, outputs, rows, &weights, 0.1)
}

/// A network that wishes to drive ahead at full speed and turn left as fast as it can, whatever it sees.
pub(crate) fn eager() -> Network<Vec<f32>> {
    always(9.0)
}

/// A network that wishes the same whatever it sees: to drive back as fast as it may and turn right, at -9.
pub(crate) fn always(bias: f32) -> Network<Vec<f32>> {
    of_weights(LOW_OBSERVATION, LOW_ACTION, 1, &vec![0.0; LOW_OBSERVATION * LOW_ACTION], bias)
}

pub(crate) fn of_weights(
    inputs: usize,
    outputs: usize,
    rows: usize,
    weights: &[f32],
    bias: f32,
) -> Network<Vec<f32>> {
    let bias = vec![bias; outputs];
    let layers = [Layer { weights, bias: &bias }];
    let mlp = MlpSpec::new(&[inputs, outputs]).expect("two sizes").output(Activation::Tanh).rows(rows);
    let spec = mlp.spec(&MlpWeights::new(&layers)).expect("fits");
    let level = CpuLevel::detect();
    Network::new(&spec, vec![0.0; spec.memory_len(level)], level).expect("fits")
}

/// On the heap: a controller is larger than what a test's thread has room for many times over.
#[inline(never)]
pub(crate) fn boxed(
    task: &Task,
    high: Option<Network<Vec<f32>>>,
    low: Network<Vec<f32>>,
) -> Box<Controller<Vec<f32>>> {
    Box::new(Controller::new(task, high, low).expect("shapes fit"))
}

pub(crate) fn controller(task: &Task) -> Box<Controller<Vec<f32>>> {
    let high = network(CANDIDATE_FEATURES, 1, ACTION_COUNT, 1, false);
    boxed(task, Some(high), network(LOW_OBSERVATION, LOW_ACTION, 1, 2, false))
}

/// Messages of step `seq`, along a made-up drive; the goal has id `goal_id`.
pub(crate) fn messages(task: &Task, seq: u64, goal_id: u32) -> (LaserScan, Odometry, Goal) {
    let header = Header { stamp_ns: seq * PERIOD_NS, seq };
    let mut scan = LaserScan { header, ..LaserScan::of(&task.lidar, |_| 0.0) };
    for (beam, range_m) in scan.ranges_m.iter_mut().enumerate() {
        *range_m = 1.0 + ((beam as u64 * 7 + seq) % 40) as f32 * 0.1;
    }
    let along = seq as f32 * 0.05;
    let odom = Odometry {
        header,
        pose: Pose::new(along, 0.1 * along, 0.02 * along),
        linear_mps: 0.5,
        ..Odometry::default()
    };
    let goal = Goal { header, x_m: 8.0, y_m: 3.0, radius_m: 0.3, id: goal_id };
    (scan, odom, goal)
}
