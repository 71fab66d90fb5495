use super::*;
use crate::families::{Family, Split, generate};
use crate::world::{Beside, Stop, WalkModel, Whom};
use crate::world::{Disc, Polygon, Segment};

const ROBOT: Footprint = Footprint::circle(0.2);

fn office_path() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("worlds/office.toml")
}

#[test]
fn the_office_can_be_used() {
    let office = load(&office_path(), &ROBOT).expect("the example is valid");
    assert!(office.people.len() >= 4 && !office.polygons.is_empty() && !office.discs.is_empty());
    let path_m = GeodesicField::new(&office, &ROBOT).distance_m(office.start.position()).expect("checked");
    assert!(path_m > 1.1 * (office.goal - office.start.position()).norm(), "{path_m} m");
}

#[test]
fn every_family_survives_the_way_to_disk_and_back() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for family in Family::ALL {
        let world = generate(family, Split::Test, 7);
        let path = folder.path().join(format!("{family}.toml"));
        save(&path, &world).expect("the world can be written");
        assert_eq!(load(&path, &ROBOT).expect("the world is valid"), world);
    }
}

#[test]
fn unknown_fields_are_refused_by_name() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("world.toml");
    let text = std::fs::read_to_string(office_path()).expect("the example");
    std::fs::write(&path, format!("obstacle_count = 3\n{text}")).expect("a file");
    let error = load(&path, &ROBOT).expect_err("there is no such field").to_string();
    assert!(error.contains("obstacle_count") && error.contains("world.toml"), "{error}");
    let error = load(&folder.path().join("none.toml"), &ROBOT).expect_err("there is no such file");
    assert!(matches!(error, WorldFileError::Read { .. }), "{error}");
}

#[test]
fn each_problem_is_named() {
    let office = load(&office_path(), &ROBOT).expect("the example is valid");
    let problem = |change: &dyn Fn(&mut World)| {
        let mut world = office.clone();
        change(&mut world);
        check(&world, &ROBOT).expect_err("the world is broken")
    };
    let center = Point::new(9.0, 6.0);
    let disc = |radius_m| Disc { center, radius_m };
    assert!(
        matches!(problem(&|world| world.discs.push(disc(-0.1))), WorldProblem::NotPositive { value, .. } if value < 0.0)
    );
    assert!(matches!(problem(&|world| world.discs.push(disc(f32::NAN))), WorldProblem::NotPositive { .. }));
    assert!(matches!(problem(&|world| world.goal.x = f32::NAN), WorldProblem::NotFinite(_)));
    let far = problem(&|world| world.bounds.max.y = 3_948_994.0);
    assert!(matches!(far, WorldProblem::TooFar(_)) && far.to_string().contains("100 km"), "{far}");
    assert_eq!(problem(&|world| world.bounds.max = world.bounds.min), WorldProblem::Bounds);
    let line = Polygon { vertices: vec![center, Point::new(9.0, 6.5)] };
    assert!(matches!(
        problem(&|world| world.polygons.push(line.clone())),
        WorldProblem::Vertices { count: 2, .. }
    ));
    assert_eq!(problem(&|world| world.people[1].waypoints.clear()), WorldProblem::NoWaypoints(1));
    let on_start = Disc { center: office.start.position(), radius_m: 0.1 };
    let blocked = problem(&|world| world.discs.push(on_start)).to_string();
    assert!(blocked.starts_with("the start at"), "{blocked}");
    let blocked = problem(&|world| world.goal = Point::new(-5.0, 0.0)).to_string();
    assert!(blocked.starts_with("the goal at (-5.00, 0.00)"), "{blocked}");
    let far = Point::new(-1.0, -1.0);
    let leg = problem(&|world| world.people[0].waypoints.push(far));
    assert!(matches!(leg, WorldProblem::Leg { person: 0, .. }), "{leg}");
    // A wall through everything; people would be stopped first.
    let wall = Segment { a: Point::new(3.0, 0.0), b: Point::new(3.0, 12.0) };
    let cut = problem(&|world| {
        world.people.clear();
        world.segments.push(wall);
    });
    assert_eq!(cut, WorldProblem::NoPath { radius_m: 0.2 });
}

#[test]
fn a_world_too_large_for_narrow_ways_does_not_say_that_there_is_none() {
    let mut world = generate(Family::Clutter, Split::Test, 1);
    (world.people, world.discs, world.polygons) = Default::default();
    let side_m = 1700.0;
    world.bounds = crate::world::Bounds { min: Point::origin(), max: Point::new(side_m, side_m) };
    (world.start.x_m, world.start.y_m, world.goal) = (5.0, 5.0, Point::new(15.0, 5.0));
    let wall = |ax, ay, bx, by| Segment { a: Point::new(ax, ay), b: Point::new(bx, by) };
    world.segments = vec![
        wall(0.0, 10.0, 20.0, 10.0),
        wall(20.0, 0.0, 20.0, 10.0),
        wall(10.0, 0.0, 10.0, 4.72),
        wall(10.0, 5.28, 10.0, 10.0),
    ];
    let problem = check(&world, &ROBOT).expect_err("the door is narrower than what is seen");
    assert!(matches!(problem, WorldProblem::NoWideWay { width_m } if width_m > 0.56), "{problem}");
    assert!(problem.to_string().contains("narrower ones are not seen"), "{problem}");
}

/// Everything that people can do goes through a file, and nonsense is told by person.
#[test]
fn people_beside_somebody_and_people_who_stop_are_written_read_and_checked() {
    let text = r#"
name = "company"
bounds = { min = [0.0, 0.0], max = [10.0, 10.0] }
start = { x_m = 1.0, y_m = 1.0, yaw_rad = 0.0 }
goal = [9.0, 9.0]

[[people]]
start = [2.0, 5.0]
waypoints = [[8.0, 5.0], [2.0, 5.0]]
radius_m = 0.25
speed_mps = 1.2
model = "social_force"
sees_robot = true
stop = { waypoint = 0, seconds = [2.0, 8.0], turns_round = 0.3 }

[[people]]
start = [2.0, 5.75]
radius_m = 0.25
speed_mps = 1.2
model = "social_force"
sees_robot = true
beside = { whom = { person = 0 }, left_m = 0.75 }

[[people]]
start = [1.0, 3.0]
radius_m = 0.25
speed_mps = 1.2
model = "orca"
sees_robot = true
beside = { whom = "robot", left_m = -0.75 }
"#;
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("company.toml");
    std::fs::write(&path, text).expect("a file");
    let world = load(&path, &ROBOT).expect("a world");
    save(&path, &world).expect("written");
    assert_eq!(load(&path, &ROBOT).expect("read again"), world);

    let problem = |change: &dyn Fn(&mut World)| {
        let mut changed = world.clone();
        change(&mut changed);
        check(&changed, &ROBOT).expect_err("nonsense").to_string()
    };
    let beside = |whom, left_m| Some(Beside { whom, left_m });
    for (person, words, changed) in [
        (1, "itself", beside(Whom::Person(1), 0.75)),
        (1, "nobody", beside(Whom::Person(3), 0.75)),
        (1, "leads them all", beside(Whom::Person(2), 0.75)),
        (1, "left_m", beside(Whom::Person(0), 0.4)),
        (1, "left_m", beside(Whom::Person(0), f32::NAN)),
        (0, "waypoints of its own", beside(Whom::Robot, 0.75)),
    ] {
        let error = problem(&|world| world.people[person].beside = changed);
        assert!(error.starts_with(&format!("person {person} cannot walk beside")), "{error}");
        assert!(error.contains(words), "{error}");
    }
    assert!(problem(&|world| world.people[2].sees_robot = false).contains("sees_robot"));
    assert!(problem(&|world| world.people[1].model = WalkModel::Scripted).contains("social_force or orca"));
    let stop = |waypoint, seconds, turns_round| Some(Stop { waypoint, seconds, turns_round });
    for (words, changed) in [
        ("waypoint", stop(2, [2.0, 8.0], 0.3)),
        ("seconds", stop(0, [8.0, 2.0], 0.3)),
        ("seconds", stop(0, [f32::NAN, 2.0], 0.3)),
        ("seconds", stop(0, [0.0, f32::INFINITY], 0.3)),
        ("turns_round", stop(0, [2.0, 8.0], 1.1)),
    ] {
        let error = problem(&|world| world.people[0].stop = changed);
        assert!(error.starts_with("person 0 cannot stop") && error.contains(words), "{error}");
    }
    assert!(problem(&|world| world.people[0].waypoints.truncate(1)).contains("two waypoints"));
}
