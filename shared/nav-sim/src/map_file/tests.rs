use super::*;
use crate::geodesic::GeodesicField;
use image::{GrayImage, Luma, Rgb, RgbImage, Rgba, RgbaImage};
use std::f32::consts::FRAC_PI_2;

const ROBOT: Footprint = Footprint::circle(0.2);

const FREE: u8 = 254;
const UNKNOWN: u8 = 205;
const OCCUPIED: u8 = 0;
const YAML: &str = "image: map.pgm\nresolution: 0.050000\norigin: [-1.0, -2.0, 0.0]\nnegate: 0\n\
                    occupied_thresh: 0.65\nfree_thresh: 0.196\n";

/// 4 x 3 m at 0.05 m: walls round it, a wall at x = 2 m with a gap above 2 m, unknown right of x = 3.5 m.
fn picture() -> GrayImage {
    GrayImage::from_fn(80, 60, |column, row| {
        let (x, y) = (column, 59 - row);
        let is_edge = x == 0 || y == 0 || x == 79 || y == 59;
        let is_wall = (x == 40 || x == 41) && y < 40;
        Luma([if is_edge || is_wall {
            OCCUPIED
        } else if x >= 70 {
            UNKNOWN
        } else {
            FREE
        }])
    })
}

struct Files(tempfile::TempDir);

impl Files {
    fn new(yaml: &str) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        std::fs::write(folder.path().join("map.yaml"), yaml).expect("a file");
        picture().save(folder.path().join("map.pgm")).expect("an image");
        Self(folder)
    }

    fn load(&self) -> Result<Map, MapError> {
        Map::load(&self.0.path().join("map.yaml"), &MapOptions::default())
    }

    fn error(&self) -> String {
        self.load().expect_err("the map is broken").to_string()
    }
}

/// The cell that holds a point of the world; `None` outside the map.
fn cell(map: &Map, point: Point) -> Option<Cell> {
    map.index(point).map(|index| map.cells[index])
}

fn start() -> Pose {
    Pose::new(0.0, -1.5, 0.0)
}

const GOAL: Point = Point::new(1.8, -1.5);

#[test]
fn a_map_becomes_a_world_with_few_walls() {
    let map = Files::new(YAML).load().expect("the map is valid");
    assert_eq!((map.columns, map.rows), (80, 60));
    assert_eq!(cell(&map, Point::new(0.0, 0.0)), Some(Cell::Free));
    assert_eq!(cell(&map, Point::new(1.05, -1.0)), Some(Cell::Occupied));
    assert_eq!(cell(&map, Point::new(2.7, 0.0)), Some(Cell::Unknown));
    assert_eq!(cell(&map, Point::new(3.01, 0.0)), None);
    let world = map.into_world(start(), GOAL).expect("there is a path");
    // A rectangle with a notch from below: eight corners.
    assert_eq!(world.segments.len(), 8, "{:?}", world.segments);
    let (low, high) = (Point::new(-1.0, -2.0), Point::new(3.0, 1.0));
    assert!((world.bounds.min - low).norm() < 1e-5 && (world.bounds.max - high).norm() < 1e-5);
    let path_m = GeodesicField::new(&world, &ROBOT).distance_m(start().position()).expect("checked");
    assert!(path_m > 3.5 && path_m < 5.0, "{path_m} m over the wall");
}

#[test]
fn unknown_cells_can_be_open() {
    let files = Files::new(YAML);
    let goal = Point::new(2.65, -1.0);
    let error = files.load().expect("valid").into_world(start(), goal).expect_err("unknown stops the robot");
    assert!(error.to_string().contains("knows nothing"), "{error}");
    let options = MapOptions { unknown_is_occupied: false, ..MapOptions::default() };
    let map = Map::load(&files.0.path().join("map.yaml"), &options).expect("valid");
    map.into_world(start(), goal).expect("there is a path through the unknown");
}

#[test]
fn walls_that_nobody_can_see_are_left_out() {
    let files = Files::new(YAML);
    let mut picture = picture();
    // A free cell amid the unknown, where the robot cannot come.
    picture.put_pixel(75, 30, Luma([FREE]));
    picture.save(files.0.path().join("map.pgm")).expect("an image");
    let map = files.load().expect("valid");
    assert_eq!(cell(&map, Point::new(2.775, -0.525)), Some(Cell::Free));
    let world = map.into_world(start(), GOAL).expect("there is a path");
    assert_eq!(world.segments.len(), 8, "{:?}", world.segments);
}

#[test]
fn a_yaw_turns_the_map() {
    let turned = YAML.replace("[-1.0, -2.0, 0.0]", &format!("[0.0, 0.0, {FRAC_PI_2}]"));
    let map = Files::new(&turned).load().expect("the map is valid");
    // (1.0, 0.5) of the picture lies at (-0.5, 1.0).
    let world = map.into_world(Pose::new(-0.5, 1.0, 0.0), Point::new(-0.5, 2.8)).expect("there is a path");
    assert!((world.bounds.min - Point::new(-3.0, 0.0)).norm() < 1e-4, "{:?}", world.bounds);
    assert!((world.bounds.max - Point::new(0.0, 4.0)).norm() < 1e-4, "{:?}", world.bounds);
}

#[test]
fn pictures_may_be_png_coloured_and_negated() {
    let files = Files::new(
        &YAML.replace("map.pgm", "'my map.png'  # drawn by hand").replace("negate: 0", "negate: 1"),
    );
    let negated = RgbImage::from_fn(80, 60, |x, y| Rgb([255 - picture().get_pixel(x, y).0[0]; 3]));
    negated.save(files.0.path().join("my map.png")).expect("an image");
    let world = files.load().expect("the map is valid").into_world(start(), GOAL).expect("there is a path");
    assert_eq!(world.segments.len(), 8);
}

#[test]
fn lists_may_have_dashes_and_optional_keys_may_be_missing() {
    let files =
        Files::new("# a map\n---\nimage: \"map.pgm\"\nresolution: 5e-2\norigin:\n- -1.0\n- -2\n- 0\n");
    let map = files.load().expect("the map is valid");
    assert!((map.resolution_m - 0.05).abs() < 1e-9);
    assert_eq!(cell(&map, Point::new(1.05, -1.0)), Some(Cell::Occupied));
}

#[test]
fn broken_descriptions_are_explained_with_their_line() {
    let change = |from: &str, to: &str| Files::new(&YAML.replace(from, to)).error();
    for (from, to, said) in [
        ("resolution: 0.050000", "resolution: -0.05", "line 2: the side of a pixel"),
        ("resolution: 0.050000", "resolution: fine", "line 2: `resolution` needs a number, not \"fine\""),
        ("resolution: 0.050000", "resolution 0.05", "line 3: this is not YAML"),
        ("resolution: 0.050000", "resolution: [0.05]", "line 2: `resolution` needs one value"),
        ("resolution: 0.050000", "resolution: {m: 0.05}", "line 2: `resolution` needs one value"),
        ("resolution: 0.050000\n", "", "has no `resolution`"),
        ("[-1.0, -2.0, 0.0]", "[-1.0, -2.0]", "line 3: `origin` needs three numbers"),
        ("[-1.0, -2.0, 0.0]", "[-1.0, -2.0, 0.0", "line 4: this is not YAML"),
        ("negate: 0", "negate: 2", "line 4: `negate` must be 0 or 1"),
        ("negate: 0", "image: other.pgm", "line 4: `image` stands here a second time"),
        ("negate: 0", "mode: costmap", "line 4: `mode` must be trinary, scale or raw"),
        ("free_thresh: 0.196", "free_thresh: 0.9", "line 6: free_thresh must not be larger"),
        ("map.pgm", "none.pgm", "none.pgm"),
    ] {
        let error = change(from, to);
        assert!(error.contains(said), "{error}");
    }
}

#[test]
fn damaged_images_are_refused() {
    let files = Files::new(YAML);
    let image = files.0.path().join("map.pgm");
    let bytes = std::fs::read(&image).expect("the image");
    std::fs::write(&image, &bytes[..bytes.len() / 2]).expect("a file");
    let error = files.error();
    assert!(error.starts_with("cannot read the image") && error.contains("map.pgm"), "{error}");
    std::fs::write(&image, "not a picture").expect("a file");
    assert!(files.error().starts_with("cannot read the image"));
}

#[test]
fn impossible_starts_and_goals_are_refused() {
    let files = Files::new(YAML);
    let refused = |start: Pose, goal: Point| {
        let map = files.load().expect("the map is valid");
        map.into_world(start, goal).expect_err("this cannot work").to_string()
    };
    let in_wall = refused(Pose::new(1.05, -1.0, 0.0), GOAL);
    assert!(in_wall.contains("the start at (1.05, -1.00) lies in an obstacle"), "{in_wall}");
    let outside = refused(start(), Point::new(9.0, 9.0));
    assert!(outside.contains("the goal at (9.00, 9.00) lies outside the map"), "{outside}");
    let touching = refused(Pose::new(0.9, -1.0, 0.0), GOAL);
    assert!(touching.contains("0.2 m of room"), "{touching}");
    let mut closed = picture();
    (0..60).for_each(|row| closed.put_pixel(40, row, Luma([OCCUPIED])));
    closed.save(files.0.path().join("map.pgm")).expect("an image");
    let cut = refused(start(), GOAL);
    assert!(cut.contains("no path"), "{cut}");
}

#[test]
fn every_way_to_write_yaml_is_understood() {
    let flow = "{image: map.pgm, resolution: 0.05, origin: [-1, -2, 0], negate: 0}";
    for yaml in [
        YAML.replace("negate: 0", "negate: false"),
        YAML.replace("[-1.0, -2.0, 0.0]", "[-1.0,\n         -2.0, 0.0]"),
        YAML.replace("[-1.0, -2.0, 0.0]", "\n  - -1.0\n  - -2.0 # down\n  - 0"),
        YAML.replace("0.65", "\"0.65\""),
        format!("\u{feff}{YAML}"),
        YAML.replace('\n', "\r\n"),
        flow.to_owned(),
    ] {
        let map = Files::new(&yaml).load().unwrap_or_else(|error| panic!("{error}:\n{yaml}"));
        assert!(map.warnings().is_empty(), "{:?} of {yaml}", map.warnings());
        assert_eq!(cell(&map, Point::new(1.05, -1.0)), Some(Cell::Occupied), "{yaml}");
        assert_eq!(cell(&map, Point::new(2.7, 0.0)), Some(Cell::Unknown), "{yaml}");
    }
}

#[test]
fn true_negates() {
    let map = Files::new(&YAML.replace("negate: 0", "negate: true")).load().expect("the map is valid");
    assert_eq!(cell(&map, Point::new(1.05, -1.0)), Some(Cell::Free), "black is free");
}

#[test]
fn unknown_keys_are_ignored_and_named() {
    let map = Files::new(&format!("{YAML}image_sha256: 'ab'\nmaker: {{name: x}}\n")).load().expect("valid");
    let [first, second] = map.warnings() else { panic!("{:?}", map.warnings()) };
    assert!(first.contains("line 7: `image_sha256` is not a key of a map"), "{first}");
    assert!(second.contains("line 8: `maker`"), "{second}");
}

#[test]
fn unknown_pixels_that_a_threshold_frees_are_counted() {
    let map = Files::new(&YAML.replace("0.196", "0.25")).load().expect("the map is valid");
    assert_eq!(cell(&map, Point::new(2.7, 0.0)), Some(Cell::Free));
    let [warning] = map.warnings() else { panic!("{:?}", map.warnings()) };
    // 9 columns of 58 pixels.
    assert!(warning.contains("522 pixels of value 205") && warning.contains("0.196"), "{warning}");
}

/// A row of pixels in a mode, as cells from left to right.
fn cells(mode: &str, pixels: &[[u8; 4]]) -> Vec<Cell> {
    let files = Files::new(&format!("{}mode: {mode}\n", YAML.replace("map.pgm", "map.png")));
    let picture = RgbaImage::from_fn(pixels.len() as u32, 1, |column, _| Rgba(pixels[column as usize]));
    picture.save(files.0.path().join("map.png")).expect("an image");
    let map = files.load().expect("the map is valid");
    let at = |column: usize| Point::new(-1.0 + 0.05 * (column as f32 + 0.5), -1.975);
    (0..pixels.len()).map(|column| cell(&map, at(column)).expect("within the map")).collect()
}

/// What `nav2_map_server` makes of the same pixels.
#[test]
fn the_modes_are_those_of_the_map_server() {
    use Cell::{Free, Occupied, Unknown};
    let gray = |value: u8| [value, value, value, 255];
    let clear = |value: u8| [value, value, value, 0];
    let pixels = [gray(254), gray(205), gray(128), gray(0), clear(255), clear(0)];
    // White and clear is (3 * 255 + 0) / 4, occupancy 0.25; gray 205 and opaque is (3 * 205 + 255) / 4, 0.15.
    assert_eq!(cells("trinary", &pixels), [Free, Free, Unknown, Occupied, Unknown, Occupied]);
    assert_eq!(cells("scale", &pixels), [Free, Unknown, Unknown, Occupied, Unknown, Unknown]);
    let percent =
        [gray(0), gray(19), gray(20), gray(65), gray(66), gray(100), gray(101), gray(255), clear(0)];
    assert_eq!(
        cells("raw", &percent),
        [Free, Free, Unknown, Unknown, Occupied, Occupied, Unknown, Unknown, Free]
    );
}

#[test]
fn coordinates_far_from_zero_are_refused_with_the_limit() {
    let utm = YAML.replace("[-1.0, -2.0, 0.0]", "[388095.0, 3948994.0, 0.0]");
    let error = Files::new(&utm).error();
    assert!(error.contains("line 3: ") && error.contains("100 km"), "{error}");
}

#[test]
fn what_is_wrong_is_said_once() {
    let files = Files::new(YAML);
    let mut closed = picture();
    (0..60).for_each(|row| closed.put_pixel(40, row, Luma([OCCUPIED])));
    closed.save(files.0.path().join("map.pgm")).expect("an image");
    let error = files.load().expect("valid").into_world(start(), GOAL).expect_err("no path");
    let mut said = error.to_string();
    let mut cause = std::error::Error::source(&error);
    while let Some(error) = cause {
        said += &format!(": {error}");
        cause = error.source();
    }
    assert_eq!(said.matches("no path").count(), 1, "{said}");
}
