use super::*;
use crate::world_file::check;
use nav_core::footprint::Footprint;

const ROBOT: Footprint = Footprint::circle(0.2);

const LIST: &str = "world,x_m,y_m,radius_m\n3,-1.0,2.0,0.25\n3,1.0,2.0,0.25\n10,0.0,2.0,0.5\n3,0.0,4.0,0.1\n";

fn surroundings() -> Surroundings {
    Surroundings { start: Pose::new(0.0, 0.0, 1.5), goal: Point::new(0.0, 5.0), margin_m: 1.0 }
}

fn read_text(text: &str) -> Result<Vec<World>, CylinderError> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("barn.csv");
    std::fs::write(&path, text).expect("a file");
    read(&path, &surroundings())
}

#[test]
fn rows_become_worlds_with_a_wall_round_them() {
    let worlds = read_text(LIST).expect("the list is valid");
    let names: Vec<&str> = worlds.iter().map(|world| world.name.as_str()).collect();
    assert_eq!(names, ["barn_3", "barn_10"]);
    assert_eq!([worlds[0].discs.len(), worlds[1].discs.len()], [3, 1]);
    assert_eq!(worlds[0].discs[2], Disc { center: Point::new(0.0, 4.0), radius_m: 0.1 });
    assert_eq!(worlds[0].bounds, Bounds { min: Point::new(-2.25, -1.0), max: Point::new(2.25, 6.0) });
    assert_eq!((worlds[1].start, worlds[1].goal), (surroundings().start, surroundings().goal));
    assert!(worlds.iter().all(|world| check(world, &ROBOT).is_ok()));
}

#[test]
fn columns_may_stand_in_any_order_beside_others() {
    let text = "radius_m, height_m, y_m, world, x_m\r\n0.25,1.0,2.0,a,-1.0\r\n";
    let worlds = read_text(text).expect("the list is valid");
    assert_eq!(worlds[0].discs, [Disc { center: Point::new(-1.0, 2.0), radius_m: 0.25 }]);
}

#[test]
fn what_makes_no_sense_is_named_with_line_and_column() {
    for (from, to, said) in [
        ("radius_m", "r", "has no column `radius_m`"),
        ("3,1.0", "3,one", "line 3, column x_m: \"one\" is not a number"),
        ("0.0,4.0,0.1", "0.0,,0.1", "line 5, column y_m: \"\" is not a number"),
        ("0.0,4.0,0.1", "nan,4.0,0.1", "line 5, column x_m: \"nan\" is not a number"),
        ("0.5", "-0.5", "line 4, column radius_m: a radius must be positive, this one is -0.5 m"),
        ("0.5", "0", "line 4, column radius_m: a radius must be positive"),
        ("3,1.0", "3,3948994.0", "line 3, column x_m: 3948994.0 is beyond 100 km"),
        ("10,", "a/b,", "line 4, column world: \"a/b\" cannot name a world"),
        ("10,", ",", "line 4, column world: \"\" cannot name a world"),
        ("0.0,4.0,0.1", "0.0,4.0", "line 5: 3 cells, the first line has 4"),
        ("0.0,4.0,0.1", "0.0,4.0,0.1,7", "line 5: 5 cells, the first line has 4"),
    ] {
        let error = read_text(&LIST.replacen(from, to, 1)).expect_err("the list is broken").to_string();
        assert!(error.contains("barn.csv") && error.contains(said), "{error}");
    }
    assert!(matches!(read_text("world,x_m,y_m,radius_m\n"), Err(CylinderError::Empty { .. })));
    let missing = read(Path::new("/nowhere/barn.csv"), &surroundings());
    assert!(matches!(missing, Err(CylinderError::Read { .. })));
}
