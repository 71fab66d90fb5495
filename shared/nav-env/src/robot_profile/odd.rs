//! What is odd about a robot, each in a sentence with what to do, before minutes are spent on training for it.

use nav_core::observation::SENT_COMMANDS;
use nav_core::scan::SECTOR_COUNT;
use nav_core::task::Task;
use std::f32::consts::TAU;

use super::{ASSUMED, RobotProfile};

/// Things as thin as this must be seen in time, m: a chair's leg, a post.
const LEG_M: f32 = 0.1;
/// Faster than this is faster than people walk, m/s.
const WALKING_MPS: f32 = 1.5;
/// An arc at full speed has at most so many radii of the footprint.
const ARC_RADII: f32 = 8.0;
/// Who sees less far than so many radii finds most dead ends by driving into them.
const SEEN_RADII: f32 = 10.0;
/// More of the footprint's radius than this should not be driven between two ticks.
const TICK_RADII: f32 = 0.5;

/// The way from full speed to a stand when something turns up: until the next tick, until the base obeys, and braking, m.
pub fn stopping_m(task: &Task) -> f32 {
    let robot = &task.robot;
    robot.linear_max_mps * (task.control_period_s + robot.latency_s) + robot.braking_m()
}

impl RobotProfile {
    /// What is odd; nothing of a robot for which everything is as usual.
    pub fn oddities(&self) -> Vec<String> {
        let task = self.task();
        let assumed = self.assumed.iter().filter_map(|field| {
            let (_, decides) = ASSUMED.iter().find(|(name, _)| name == field)?;
            Some(format!(
                "robot.{field} is not said, and a usual value is assumed; it decides {decides}: measure it"
            ))
        });
        let found = [base(&task), sight(&task), rhythm(&task)].into_iter().flatten();
        assumed.chain(found.flatten()).collect()
    }
}

/// The base, by itself.
fn base(task: &Task) -> Vec<Option<String>> {
    let robot = &task.robot;
    let arc_m = robot.linear_max_mps / robot.angular_max_radps;
    vec![
        (robot.linear_max_mps > WALKING_MPS).then(|| {
            format!(
                "drives {} m/s, faster than people walk (1.4 m/s): they cannot step aside in time; lower \
                 robot.linear_max_mps where people are",
                robot.linear_max_mps
            )
        }),
        (arc_m > ARC_RADII * robot.footprint.circumradius_m()).then(|| {
            format!(
                "turns {} rad/s, so that at full speed it drives arcs of {arc_m:.1} m, {:.0} of its radii: it will crawl \
                 through corners; lower robot.linear_max_mps if robot.angular_max_radps is right",
                robot.angular_max_radps,
                arc_m / robot.footprint.circumradius_m()
            )
        }),
        (robot.latency_s <= 0.0).then(|| {
            "robot.latency_s is 0: no base obeys at once, and the safety gate would trust that; measure from command to \
             motion"
                .to_owned()
        }),
    ]
}

/// The lidar, against what the base needs.
fn sight(task: &Task) -> Vec<Option<String>> {
    let (robot, lidar) = (&task.robot, &task.lidar);
    // From the lidar: what of the robot lies ahead of it, and the way to a stand.
    let needed_m = robot.footprint.reach_m(1.0, 0.0) - lidar.mount.x_m + stopping_m(task);
    // To the nearest of the outline.
    let edge_m = -robot.footprint.distance_m(lidar.mount.position());
    let gap_m = lidar.angle_increment_rad() * needed_m;
    let view_rad = lidar.field_of_view_rad.min(TAU);
    let degrees = view_rad.to_degrees();
    let enough_for = |apart_rad: f32| (view_rad / apart_rad).ceil() as u32 + 1;
    vec![
        (needed_m > lidar.range_max_m).then(|| {
            format!(
                "needs {needed_m:.1} m from its lidar to stop, and the lidar sees {} m: it cannot use its speed; lower \
                 robot.linear_max_mps, or raise lidar.range_max_m if the sensor sees farther",
                lidar.range_max_m
            )
        }),
        (lidar.mount.yaw_rad.abs() > 0.5 * view_rad).then(|| {
            format!(
                "the lidar ({degrees:.0} degrees, turned by {:.0}) does not see what lies straight ahead: the robot would \
                 drive blind; lidar.mount.yaw_rad is where the lidar's own x axis looks on the robot",
                lidar.mount.yaw_rad.to_degrees()
            )
        }),
        (robot.reverses() && !lidar.is_full_circle()).then(|| {
            format!(
                "may drive backwards, and the lidar ({degrees:.0} degrees) does not see what is there: it never will; set \
                 robot.linear_min_mps = 0, or add a lidar and merge the scans"
            )
        }),
        (lidar.range_min_m > edge_m).then(|| {
            format!(
                "the lidar measures from {} m on, and the footprint ends {edge_m:.2} m from it: between them nothing is exact; \
                 mount it farther in, or lower lidar.range_min_m if the sensor is better than that",
                lidar.range_min_m
            )
        }),
        (gap_m > LEG_M).then(|| {
            format!(
                "beams are {gap_m:.2} m apart where the robot must begin to stop ({needed_m:.1} m): a leg of {LEG_M} m may \
                 stand between two; lidar.beam_count = {} sees it",
                enough_for(LEG_M / needed_m)
            )
        }),
        (lidar.angle_increment_rad() > TAU / SECTOR_COUNT as f32 + 1e-4).then(|| {
            format!(
                "beams are {:.0} degrees apart, and the policy sees {SECTOR_COUNT} sectors: some have no beam; \
                 lidar.beam_count = {} fills them",
                lidar.angle_increment_rad().to_degrees(),
                enough_for(TAU / SECTOR_COUNT as f32)
            )
        }),
        (lidar.range_max_m < SEEN_RADII * robot.footprint.circumradius_m()).then(|| {
            format!(
                "the lidar sees {:.0} radii of the footprint: most dead ends are found by driving into them; raise \
                 lidar.range_max_m if the sensor sees farther",
                lidar.range_max_m / robot.footprint.circumradius_m()
            )
        }),
    ]
}

/// The control loop. A tick that is longer than braking takes is harmless as long as little is driven in it.
fn rhythm(task: &Task) -> Vec<Option<String>> {
    let (robot, period_s) = (&task.robot, task.control_period_s);
    let driven_m = robot.linear_max_mps * period_s;
    let braking_s = robot.linear_max_mps / robot.linear_acceleration_mps2;
    let step_ticks = task.ticks(task.scale().step_s());
    let seen_s = (SENT_COMMANDS as u32 * step_ticks) as f32 * period_s;
    let (is_far, is_long) = (
        driven_m > 2.0 * robot.footprint.circumradius_m(),
        period_s > braking_s && driven_m > TICK_RADII * robot.footprint.circumradius_m(),
    );
    vec![
        is_far.then(|| {
            format!(
                "drives {driven_m:.2} m, more than its own size, between two ticks: lower control_period_s to {:.3}",
                robot.footprint.circumradius_m() / robot.linear_max_mps
            )
        }),
        (is_long && !is_far).then(|| {
            format!(
                "brakes in {braking_s:.2} s, but decides to only each {period_s} s, in which it drives {driven_m:.2} m: lower \
                 control_period_s"
            )
        }),
        (robot.latency_s > seen_s + 1e-4).then(|| {
            format!(
                "obeys up to {} s late, and the policy sees what it commanded in the last {seen_s:.2} s: it cannot know what \
                 is under way; raise control_period_s to {:.2}, or make the base faster",
                robot.latency_s,
                robot.latency_s / SENT_COMMANDS as f32
            )
        }),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use nav_core::task::{Lidar, Robot};

    fn profile(change: impl Fn(&mut RobotProfile)) -> RobotProfile {
        let mut profile = RobotProfile {
            name: "mine".to_owned(),
            robot: Robot::default(),
            // So dense that nothing stands between two beams, however fast it is.
            lidar: Lidar { beam_count: 360, ..Lidar::default() },
            control_period_s: 0.1,
            assumed: Vec::new(),
        };
        change(&mut profile);
        profile
    }

    #[test]
    fn nothing_is_odd_about_the_reference_robot() {
        assert_eq!(profile(|_| ()).oddities(), Vec::<String>::new());
        assert_eq!(profile(|own| own.lidar = Lidar::default()).oddities(), Vec::<String>::new());
    }

    #[test]
    fn each_oddity_is_told_alone_and_with_what_to_do() {
        type Change = fn(&mut RobotProfile);
        let cases: [(Change, &str, &str); 14] = [
            (|odd| odd.robot.linear_max_mps = 1.55, "faster than people walk", "lower robot.linear_max_mps"),
            (|odd| odd.robot.angular_max_radps = 0.5, "arcs of 2.0 m", "lower robot.linear_max_mps"),
            (|odd| odd.robot.latency_s = 0.0, "no base obeys at once", "measure"),
            (
                |odd| odd.robot.linear_acceleration_mps2 = 0.1,
                "needs 5.5 m from its lidar to stop, and the lidar sees 5 m",
                "raise lidar.range_max_m",
            ),
            (
                |odd| (odd.robot.linear_min_mps, odd.lidar.field_of_view_rad) = (-0.2, 4.7),
                "the lidar (269 degrees) does not see",
                "robot.linear_min_mps = 0",
            ),
            (
                |odd| (odd.lidar.mount.yaw_rad, odd.lidar.field_of_view_rad) = (3.0, 4.7),
                "turned by 172) does not see what lies straight ahead",
                "lidar.mount.yaw_rad",
            ),
            (|odd| odd.lidar.mount.x_m = -0.17, "the footprint ends 0.03 m from it", "mount it farther in"),
            (|odd| odd.lidar.range_min_m = 0.3, "measures from 0.3 m on", "lower lidar.range_min_m"),
            (
                |odd| odd.lidar.beam_count = 40,
                "a leg of 0.1 m may stand between two",
                "lidar.beam_count = 49",
            ),
            (
                |odd| (odd.lidar.beam_count, odd.robot.linear_max_mps) = (30, 0.3),
                "the policy sees 36 sectors",
                "lidar.beam_count = 37",
            ),
            (|odd| odd.lidar.range_max_m = 1.9, "the lidar sees 10 radii", "raise lidar.range_max_m"),
            (
                |odd| odd.control_period_s = 0.45,
                "drives 0.45 m, more than its own size",
                "lower control_period_s to 0.200",
            ),
            (
                |odd| {
                    (odd.control_period_s, odd.robot.linear_acceleration_mps2) = (0.15, 8.0);
                },
                "brakes in 0.12 s, but decides to only each 0.15 s",
                "lower control_period_s",
            ),
            (|odd| odd.robot.latency_s = 0.25, "in the last 0.20 s", "raise control_period_s to 0.12"),
        ];
        for (change, what, remedy) in cases {
            let found = profile(change).oddities();
            assert_eq!(found.len(), 1, "{what}: {found:?}");
            assert!(found[0].contains(what) && found[0].contains(remedy), "{what}: {found:?}");
        }
        let said = profile(|odd| odd.assumed = vec!["latency_s"]).oddities();
        assert!(said.len() == 1 && said[0].contains("robot.latency_s is not said"), "{said:?}");
    }

    #[test]
    fn what_is_odd_about_the_built_in_robots_is_known() {
        let odd: Vec<String> = super::super::names()
            .flat_map(|name| {
                let profile = RobotProfile::read(name).expect("built in");
                profile.oddities().into_iter().map(move |said| format!("{name} {said}"))
            })
            .collect();
        let known = [
            "turtlebot3_burger the lidar measures from 0.12 m on, and the footprint ends 0.07 m from it",
            "turtlebot4 the lidar measures from 0.15 m on, and the footprint ends 0.13 m from it",
            "jackal drives 2 m/s, faster than people walk",
        ];
        assert_eq!(odd.len(), known.len(), "{odd:#?}");
        assert!(odd.iter().zip(known).all(|(odd, known)| odd.starts_with(known)), "{odd:#?}");
    }
}
