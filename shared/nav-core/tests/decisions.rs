//! When a decision ends, and what the high level sees without a map.

use nav_core::geometry::Pose;
use nav_core::messages::{Goal, Header, LaserScan, Odometry};
use nav_core::navigator::{DecisionReason, Navigator};
use nav_core::task::{ACTION_GOAL, ACTION_WAIT, Memory, Task};

/// A robot on the x axis that faces its goal 8 m ahead.
struct Scene {
    task: Task,
    navigator: Navigator,
    seq: u64,
    yaw_rad: f32,
    goal_x_m: f32,
}

impl Scene {
    fn new(task: Task) -> Self {
        Self { task, navigator: Navigator::new(&task), seq: 0, yaw_rad: 0.0, goal_x_m: 8.0 }
    }

    /// A step at `x_m` with a thing ahead at `gap_m`, 40 degrees wide, and nothing else.
    fn see(&mut self, x_m: f32, gap_m: f32) -> Option<DecisionReason> {
        self.seq += 1;
        let header = Header { stamp_ns: self.seq * self.task.control_period_ns(), seq: self.seq };
        let lidar = &self.task.lidar;
        let ahead = |angle: f32| if angle.abs() < 0.35 { gap_m } else { f32::INFINITY };
        let scan = LaserScan { header, ..LaserScan::of(lidar, ahead) };
        let odom = Odometry {
            header,
            pose: Pose::new(x_m, 0.0, self.yaw_rad),
            linear_mps: 1.0,
            ..Odometry::default()
        };
        let goal = Goal { header, x_m: self.goal_x_m, y_m: 0.0, radius_m: 0.3, id: 1 };
        self.navigator.observe(&scan, &odom, &goal);
        self.navigator.decision_due()
    }

    fn choose(&mut self, action: usize) {
        let (_, mask) = self.navigator.prepare_decision();
        assert!(mask.allows(action), "{action} is legal here");
        self.navigator.commit(action);
    }
}

const FREE: f32 = f32::INFINITY;
/// The direction of the goal, as one of the sixteen.
const AHEAD: usize = 0;

#[test]
fn a_subgoal_that_is_reached_ends_its_decision() {
    let mut scene = Scene::new(Task::default());
    assert_eq!(scene.see(0.0, FREE), Some(DecisionReason::Start));
    scene.choose(AHEAD);
    // 2 m away; it counts as reached at 0.4 m.
    for step in 1..=15_u8 {
        assert_eq!(scene.see(0.1 * f32::from(step), FREE), None, "step {step}");
    }
    assert_eq!(scene.see(1.65, FREE), Some(DecisionReason::Reached));
}

#[test]
fn the_goal_is_held_for_twenty_steps_and_waiting_for_five() {
    let mut scene = Scene::new(Task::default());
    scene.see(0.0, FREE);
    scene.choose(ACTION_GOAL);
    for step in 1..20_u8 {
        assert_eq!(scene.see(0.1 * f32::from(step), FREE), None, "step {step}");
    }
    assert_eq!(scene.see(2.0, FREE), Some(DecisionReason::Expired));
    scene.choose(ACTION_WAIT);
    for _ in 0..4 {
        assert_eq!(scene.see(2.0, FREE), None);
    }
    assert_eq!(scene.see(2.0, FREE), Some(DecisionReason::Expired));
}

#[test]
fn a_robot_that_does_not_move_is_stuck_after_ten_steps() {
    let mut scene = Scene::new(Task::default());
    scene.see(0.0, FREE);
    scene.choose(AHEAD);
    for step in 1..10 {
        assert_eq!(scene.see(0.0, FREE), None, "step {step}");
    }
    assert_eq!(scene.see(0.0, FREE), Some(DecisionReason::Stuck));
}

#[test]
fn what_came_to_nothing_is_not_offered_again_in_that_place() {
    let mut scene = Scene::new(Task::default());
    scene.see(0.0, FREE);
    let mut tried = Vec::new();
    for _ in 0..6 {
        let (observation, mask) = scene.navigator.prepare_decision();
        let stood = observation[nav_core::observation::HIGH_OBSERVATION - 1];
        assert!((stood - 0.2 * tried.len() as f32).abs() < 0.1, "it sees for how long it stands: {stood}");
        // One that always likes the goal best, then the lowest number.
        let action = if mask.allows(ACTION_GOAL) { ACTION_GOAL } else { mask.actions().next().expect("one") };
        assert!(!tried.contains(&action), "{action} again after {tried:?}");
        tried.push(action);
        scene.navigator.commit(action);
        while scene.see(0.0, FREE).is_none() {}
    }
    scene.see(0.6, FREE);
    scene.navigator.commit(ACTION_GOAL);
    let (_, mask) = scene.navigator.prepare_decision();
    assert!(tried.iter().all(|&action| mask.allows(action)), "elsewhere all may be tried again");
}

#[test]
fn a_turn_on_the_spot_is_not_stuck() {
    let mut scene = Scene::new(Task::default());
    scene.see(0.0, FREE);
    scene.choose(AHEAD);
    for step in 1..20_u8 {
        scene.yaw_rad = 0.1 * f32::from(step);
        assert_eq!(scene.see(0.0, FREE), None, "step {step}");
    }
}

#[test]
fn a_correction_of_the_goal_is_followed_at_once_and_nothing_is_forgotten() {
    let mut scene = Scene::new(Task::default());
    for step in 0..=76_u8 {
        scene.see(0.1 * f32::from(step), FREE);
    }
    scene.see(7.95, FREE);
    assert!(scene.navigator.goal_reached());
    let visits = scene.navigator.map().visit_density(nav_core::geometry::Point::new(4.0, 0.0));
    scene.goal_x_m = 8.1;
    scene.see(7.95, FREE);
    assert!(scene.navigator.goal_reached(), "still well inside");
    scene.goal_x_m = 8.5;
    scene.see(7.95, FREE);
    assert!(!scene.navigator.goal_reached(), "it lies elsewhere");
    assert!((scene.navigator.goal().x - 8.5).abs() < 1e-6);
    let now = scene.navigator.map().visit_density(nav_core::geometry::Point::new(4.0, 0.0));
    assert!(visits > 0.0 && (visits - now).abs() < 1e-6, "the memory stays: {visits} {now}");
    scene.see(8.45, FREE);
    assert!(scene.navigator.goal_reached());
}

#[test]
fn a_policy_does_not_see_the_time_limit_of_an_episode() {
    let elapsed = |episode_s: f32| {
        let mut scene = Scene::new(Task { episode_s, ..Task::default() });
        for step in 0..50_u8 {
            scene.see(0.1 * f32::from(step), FREE);
        }
        scene.navigator.prepare_decision().0.map(f32::to_bits)
    };
    assert_eq!(elapsed(25.0), elapsed(1_000.0));
}

#[test]
fn something_in_the_way_ends_a_direction_and_not_the_goal() {
    for (action, expected) in [(AHEAD, Some(DecisionReason::Blocked)), (ACTION_GOAL, None)] {
        let mut task = Task::default();
        // Something that appears is a threat too, and that is not the question here.
        task.decision.time_to_collision_s = 0.0;
        let mut scene = Scene::new(task);
        scene.see(0.0, FREE);
        scene.choose(action);
        for step in 1..=3_u8 {
            assert_eq!(scene.see(0.1 * f32::from(step), FREE), None);
        }
        let due = (4..=8_u8).find_map(|step| scene.see(0.1 * f32::from(step), 1.4 - 0.1 * f32::from(step)));
        assert_eq!(due, expected, "action {action}");
    }
}

#[test]
fn somebody_who_comes_close_fast_is_a_threat() {
    let mut scene = Scene::new(Task::default());
    scene.see(0.0, 4.0);
    scene.choose(ACTION_GOAL);
    // 1 m/s each: 3 m in 1.5 s, less the radius.
    let reasons: Vec<_> =
        (1..=8_u8).map(|step| scene.see(0.1 * f32::from(step), 4.0 - 0.2 * f32::from(step))).collect();
    let first = reasons.iter().position(Option::is_some).expect("it comes close");
    assert_eq!(reasons[first], Some(DecisionReason::Threat));
    let gap_m = 4.0 - 0.2 * (first + 1) as f32;
    assert!((2.9..=3.3).contains(&gap_m), "{gap_m}");
}

#[test]
fn without_a_map_no_geodesic_is_seen() {
    let mut task = Task::default();
    let gains = |task: Task| {
        let mut scene = Scene::new(task);
        for step in 0..6_u8 {
            scene.see(0.1 * f32::from(step), 1.5);
        }
        let (observation, _) = scene.navigator.prepare_decision();
        (0..16).map(|k| observation[6 * k + 1]).collect::<Vec<f32>>()
    };
    assert!(gains(task).iter().any(|gain| gain.abs() > 0.1), "the profile `full` remembers");
    task.decision.memory = Memory::Lite;
    assert!(gains(task).iter().all(|gain| gain.abs() <= 0.0), "the profile `lite` does not");
}
