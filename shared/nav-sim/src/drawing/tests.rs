use super::*;
use crate::families::{Family, Split, generate};
use crate::world::{Bounds, Person, Segment};
use nav_core::geometry::Vector;

fn trace() -> EpisodeTrace {
    let mut world = generate(Family::Crowd, Split::Train, 1);
    world.bounds = Bounds { min: Point::new(0.0, 0.0), max: Point::new(14.0, 14.0) };
    world.segments = vec![Segment { a: Point::new(2.0, 7.0), b: Point::new(12.0, 7.0) }];
    world.goal = Point::new(10.0, 12.0);
    world.start = Pose::new(4.0, 2.0, 0.5);
    for person in &mut world.people {
        person.start = Point::new(1.0, 1.0);
    }
    let standing = |person: &Person| PersonState {
        position: person.start,
        velocity: Vector::zeros(),
        radius_m: person.radius_m,
    };
    let people: Vec<PersonState> = world.people.iter().map(standing).collect();
    let steps = (0..30_u8)
        .map(|step| TraceStep {
            pose: Pose::new(4.0 + 0.1 * f32::from(step), 2.0, 0.0),
            people: people.clone(),
            seen: None,
        })
        .collect();
    EpisodeTrace {
        world: Arc::new(world),
        footprint: Footprint::circle(0.2),
        goal_radius_m: 0.3,
        title: "a <test> & more".into(),
        period_s: 0.1,
        steps,
        decisions: vec![Decision { step: 3, subgoal: Point::new(6.0, 4.0), action: 2 }],
        end: Some(EpisodeEnd::Timeout),
        hit_while_standing: false,
    }
}

/// The pixel of a PNG at a point of the world.
fn pixel(picture: &image::RgbImage, point: Point) -> [u8; 3] {
    let unit = PICTURE_PX / 100.0;
    let scale = (PICTURE_PX - 6.0 * unit) / 14.0;
    let (x, y) = (3.0 * unit + point.x * scale, 8.0 * unit + (14.0 - point.y) * scale);
    picture.get_pixel((2.0 * x) as u32, (2.0 * y) as u32).0
}

#[test]
fn a_png_shows_things_where_they_are() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("episode.png");
    write_picture(&path, &svg(&trace())).expect("the picture can be written");
    let picture = image::open(&path).expect("a PNG").into_rgb8();
    let [red, green, blue] = pixel(&picture, Point::new(9.0, 7.0));
    assert!(red < 90 && green < 90 && blue < 100, "wall: {red} {green} {blue}");
    let [red, green, _] = pixel(&picture, Point::new(10.0, 12.0));
    assert!(green > red + 40, "goal: {red} {green}");
    let [red, _, blue] = pixel(&picture, Point::new(5.5, 2.0));
    assert!(blue > red + 40, "way: {red} {blue}");
    let [red, green, blue] = pixel(&picture, Point::new(6.0, 4.0));
    assert!(red > green && blue > green, "subgoal: {red} {green} {blue}");
    let floor = pixel(&picture, Point::new(12.0, 4.0));
    assert!(floor.iter().all(|&channel| channel > 240), "floor: {floor:?}");
    let [red, _, blue] = pixel(&picture, Point::new(1.0, 1.0));
    assert!(red > blue + 40, "people: {red} {blue}");
}

#[test]
fn the_end_shows_in_its_colour() {
    let crashed = EpisodeTrace { end: Some(EpisodeEnd::Collision), ..trace() };
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("crash.png");
    write_picture(&path, &svg(&crashed)).expect("the picture can be written");
    let picture = image::open(&path).expect("a PNG").into_rgb8();
    let last = crashed.steps.last().expect("steps").pose.position();
    let [red, _, blue] = pixel(&picture, last + Vector::new(-0.1, 0.1));
    assert!(red > blue + 40, "a crashed robot is red: {red} {blue}");
}

#[test]
fn an_svg_is_written_as_it_is_and_escaped() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("episode.svg");
    let text = svg(&trace());
    write_picture(&path, &text).expect("the picture can be written");
    assert_eq!(std::fs::read_to_string(&path).expect("a text"), text);
    assert!(text.contains("a &lt;test&gt; &amp; more"));
}

#[test]
fn sheets_have_rows_and_columns_and_may_be_empty() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let bare = EpisodeTrace { steps: Vec::new(), decisions: Vec::new(), end: None, ..trace() };
    for (count, columns, width) in [(5, 2, 2.0), (1, 4, 1.0), (0, 3, 1.0)] {
        let text = svg_sheet(&vec![bare.clone(); count], columns);
        let path = folder.path().join("sheet.png");
        write_picture(&path, &text).expect("the sheet can be written");
        let picture = image::open(&path).expect("a PNG");
        assert!((picture.width() as f32 - 2.0 * width * TILE_PX).abs() <= 2.0, "{} px", picture.width());
        assert_eq!(text.matches("<title>").count(), count);
    }
}

#[test]
fn what_cannot_be_written_is_said() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let unknown = write_picture(&folder.path().join("episode.jpg"), "<svg/>").expect_err("no such format");
    assert!(unknown.to_string().contains(".svg or .png"), "{unknown}");
    let invalid = write_picture(&folder.path().join("episode.png"), "no picture").expect_err("no SVG");
    assert!(matches!(invalid, DrawError::InvalidSvg(_)), "{invalid}");
    let nowhere = write_picture(&folder.path().join("none/episode.svg"), "<svg/>").expect_err("no folder");
    assert!(matches!(nowhere, DrawError::Write { .. }), "{nowhere}");
}
