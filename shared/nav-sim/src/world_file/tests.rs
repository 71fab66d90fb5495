use super::*;
use crate::families::{Family, Split, generate};
use crate::world::{Disc, Polygon, Segment};

fn office_path() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("worlds/office.toml")
}

#[test]
fn the_office_can_be_used() {
    let office = load(&office_path(), 0.2).expect("the example is valid");
    assert!(office.people.len() >= 4 && !office.polygons.is_empty() && !office.discs.is_empty());
    let path_m = GeodesicField::new(&office, 0.2).distance_m(office.start.position()).expect("checked");
    assert!(path_m > 1.1 * (office.goal - office.start.position()).norm(), "{path_m} m");
}

#[test]
fn every_family_survives_the_way_to_disk_and_back() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for family in Family::ALL {
        let world = generate(family, Split::Test, 7);
        let path = folder.path().join(format!("{family}.toml"));
        save(&path, &world).expect("the world can be written");
        assert_eq!(load(&path, 0.2).expect("the world is valid"), world);
    }
}

#[test]
fn unknown_fields_are_refused_by_name() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("world.toml");
    let text = std::fs::read_to_string(office_path()).expect("the example");
    std::fs::write(&path, format!("obstacle_count = 3\n{text}")).expect("a file");
    let error = load(&path, 0.2).expect_err("there is no such field").to_string();
    assert!(error.contains("obstacle_count") && error.contains("world.toml"), "{error}");
    let error = load(&folder.path().join("none.toml"), 0.2).expect_err("there is no such file");
    assert!(matches!(error, WorldFileError::Read { .. }), "{error}");
}

#[test]
fn each_problem_is_named() {
    let office = load(&office_path(), 0.2).expect("the example is valid");
    let problem = |change: &dyn Fn(&mut World)| {
        let mut world = office.clone();
        change(&mut world);
        check(&world, 0.2).expect_err("the world is broken")
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
    let problem = check(&world, 0.2).expect_err("the door is narrower than what is seen");
    assert!(matches!(problem, WorldProblem::NoWideWay { width_m } if width_m > 0.56), "{problem}");
    assert!(problem.to_string().contains("narrower ones are not seen"), "{problem}");
}
