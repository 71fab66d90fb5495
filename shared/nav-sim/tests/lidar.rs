//! The lidar against brute force, and against the collision geometry.

mod common;

use nav_core::geometry::{Point, Pose};
use nav_core::task;
use nav_sim::collision::closest_on_segment;
use nav_sim::lidar::Lidar;
use nav_sim::obstacles::Obstacles;
use nav_sim::world::{Bounds, Disc, Polygon, Segment, World};
use proptest::prelude::*;
use std::f32::consts::{PI, TAU};

const SIDE_M: f32 = 12.0;

fn place(side_m: f32) -> impl Strategy<Value = Point> {
    (0.01..side_m - 0.01, 0.01..side_m - 0.01).prop_map(|(x, y)| Point::new(x, y))
}

fn disc(side_m: f32) -> impl Strategy<Value = Disc> {
    (place(side_m), 0.05..0.8_f32).prop_map(|(center, radius_m)| Disc { center, radius_m })
}

fn segment(side_m: f32) -> impl Strategy<Value = Segment> {
    (place(side_m), place(side_m)).prop_map(|(a, b)| Segment { a, b })
}

fn short_segment(side_m: f32) -> impl Strategy<Value = Segment> {
    (place(side_m), -1.5..1.5_f32, -1.5..1.5_f32)
        .prop_map(|(a, x, y)| Segment { a, b: Point::new(a.x + x, a.y + y) })
}

/// A star-shaped polygon: corners at rising angles round a centre, in either winding.
fn polygon(side_m: f32) -> impl Strategy<Value = Polygon> {
    (place(side_m), prop::collection::vec(0.2..1.2_f32, 3..8), any::<bool>()).prop_map(
        |(center, radii, turn)| {
            let count = radii.len() as f32;
            let corner = |(k, radius): (usize, &f32)| {
                let angle = k as f32 * TAU / count;
                Point::new(center.x + radius * angle.cos(), center.y + radius * angle.sin())
            };
            let mut vertices: Vec<Point> = radii.iter().enumerate().map(corner).collect();
            if turn {
                vertices.reverse();
            }
            Polygon { vertices }
        },
    )
}

fn small_world() -> impl Strategy<Value = World> {
    let discs = prop::collection::vec(disc(SIDE_M), 0..12);
    let segments = prop::collection::vec(segment(SIDE_M), 0..8);
    let polygons = prop::collection::vec(polygon(SIDE_M), 0..4);
    (discs, segments, polygons).prop_map(|(discs, segments, polygons)| World {
        discs,
        segments,
        polygons,
        ..common::room(SIDE_M)
    })
}

/// Large enough to be split into cells, with some long walls that must be cut.
fn large_world() -> impl Strategy<Value = World> {
    let discs = prop::collection::vec(disc(30.0), 0..60);
    let short = prop::collection::vec(short_segment(30.0), 130..200);
    let long = prop::collection::vec(segment(30.0), 0..4);
    (discs, short, long).prop_map(|(discs, mut segments, long)| {
        segments.extend(long);
        let bounds = Bounds { min: Point::new(-1.0, -2.0), max: Point::new(32.0, 31.0) };
        World { discs, segments, bounds, ..common::room(30.0) }
    })
}

fn lidar() -> impl Strategy<Value = task::Lidar> {
    let field = prop_oneof![Just(TAU), 0.2..TAU];
    let count = prop_oneof![Just(1_u32), Just(72), Just(1440), 2..400_u32];
    (count, field, 1.0..25.0_f32).prop_map(|(beam_count, field_of_view_rad, range_max_m)| task::Lidar {
        beam_count,
        field_of_view_rad,
        range_min_m: 0.05,
        range_max_m,
        mount: Pose::default(),
    })
}

/// Every static edge of a world, and every disc.
fn primitives(world: &World) -> (Vec<Segment>, Vec<Disc>) {
    let mut edges: Vec<Segment> = world.bounds.edges().to_vec();
    edges.extend(&world.segments);
    for polygon in &world.polygons {
        let count = polygon.vertices.len();
        edges.extend(
            (0..count).map(|k| Segment { a: polygon.vertices[k], b: polygon.vertices[(k + 1) % count] }),
        );
    }
    (edges, world.discs.clone())
}

/// Each beam against each obstacle, in f64, by solving the two equations.
fn brute_force(world: &World, moving: &[Disc], origin: Point, angle_rad: f64, range_max_m: f64) -> f64 {
    let (y, x) = angle_rad.sin_cos();
    let mut nearest = f64::INFINITY;
    let (edges, discs) = primitives(world);
    for edge in &edges {
        let (ax, ay) = (f64::from(edge.a.x) - f64::from(origin.x), f64::from(edge.a.y) - f64::from(origin.y));
        let (ex, ey) = (f64::from(edge.b.x) - f64::from(edge.a.x), f64::from(edge.b.y) - f64::from(edge.a.y));
        let determinant = x * ey - y * ex;
        let range = (ax * ey - ay * ex) / determinant;
        let share = (ax * y - ay * x) / determinant;
        if range >= 0.0 && (0.0..=1.0).contains(&share) {
            nearest = nearest.min(range);
        }
    }
    for disc in discs.iter().chain(moving) {
        let cx = f64::from(disc.center.x) - f64::from(origin.x);
        let cy = f64::from(disc.center.y) - f64::from(origin.y);
        let radius = f64::from(disc.radius_m);
        let (half_b, c) = (cx * x + cy * y, cx * cx + cy * cy - radius * radius);
        if c <= 0.0 {
            return 0.0;
        }
        let discriminant = half_b * half_b - c;
        if discriminant >= 0.0 && half_b > 0.0 {
            nearest = nearest.min(half_b - discriminant.sqrt());
        }
    }
    if nearest > range_max_m { f64::INFINITY } else { nearest }
}

/// The fast scan equals brute force, give or take a beam turned by 2e-5 rad (rounding of f32 directions).
fn agrees(world: &World, moving: &[Disc], spec: &task::Lidar, pose: Pose) -> Result<(), TestCaseError> {
    let mut lidar = Lidar::new(spec);
    let ranges_m = lidar.cast(pose, &Obstacles::new(world), moving.iter().copied());
    prop_assert_eq!(ranges_m.len(), spec.beam_count as usize);
    for (beam, &range_m) in ranges_m.iter().enumerate() {
        let angle_rad = f64::from(pose.yaw_rad)
            + f64::from(spec.angle_min_rad())
            + beam as f64 * f64::from(spec.angle_increment_rad());
        let exact = |turn: f64, reach: f64| {
            let range_max_m = f64::from(spec.range_max_m) + reach;
            brute_force(world, moving, pose.position(), angle_rad + turn, range_max_m)
        };
        let tolerance_m = 2e-3;
        let around: Vec<f64> = [-2e-5, -1e-5, 0.0, 1e-5, 2e-5]
            .into_iter()
            .flat_map(|turn| [-tolerance_m, tolerance_m].map(|reach| exact(turn, reach)))
            .collect();
        let low = around.iter().copied().fold(f64::INFINITY, f64::min);
        let high = around.iter().copied().fold(0.0, f64::max);
        let range = f64::from(range_m);
        prop_assert!(
            (low - tolerance_m..=high + tolerance_m).contains(&range)
                || (range_m.is_infinite() && high.is_infinite()),
            "beam {beam}: {range_m} outside {low}..{high}"
        );
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn a_scan_of_a_small_world_is_that_of_brute_force(
        world in small_world(),
        moving in prop::collection::vec(disc(SIDE_M), 0..4),
        spec in lidar(),
        at in place(SIDE_M),
        yaw_rad in -PI..PI,
    ) {
        agrees(&world, &moving, &spec, Pose::new(at.x, at.y, yaw_rad))?;
    }

    #[test]
    fn the_nearest_obstacle_is_seen_where_collision_says_it_is(
        world in prop_oneof![small_world(), large_world()],
        at in place(SIDE_M),
    ) {
        let obstacles = Obstacles::new(&world);
        let distance_m = obstacles.distance_m(at, 50.0);
        prop_assume!(distance_m > 0.01);
        let (edges, discs) = primitives(&world);
        let on_discs = discs.iter().map(|disc| {
            let away = at - disc.center;
            disc.center + away * (disc.radius_m / away.norm())
        });
        let nearest = edges.iter().map(|edge| closest_on_segment(at, edge)).chain(on_discs)
            .min_by(|a, b| (a - at).norm().total_cmp(&(b - at).norm()))
            .expect("the bounds are always there");
        prop_assert!(((nearest - at).norm() - distance_m).abs() < 1e-4, "{nearest} {distance_m}");

        // A fine fan of beams around the nearest point: none is shorter than the distance, and one as long.
        let toward = nearest - at;
        let yaw_rad = toward.y.atan2(toward.x);
        let spec = task::Lidar { beam_count: 1439, field_of_view_rad: 0.1, range_min_m: 0.0, range_max_m: 60.0, ..task::Lidar::default() };
        let mut lidar = Lidar::new(&spec);
        let fan = lidar.cast(Pose::new(at.x, at.y, yaw_rad), &obstacles, std::iter::empty());
        let shortest_m = fan.iter().copied().fold(f32::INFINITY, f32::min);
        prop_assert!(shortest_m > distance_m - 1e-3, "{shortest_m} < {distance_m}");
        // The free end of a wall seen along the wall is thinner than any beam.
        let is_tip = world.segments.iter().flat_map(|segment| [segment.a, segment.b])
            .any(|end| (end - nearest).norm() < 1e-3);
        prop_assert!(is_tip || shortest_m < distance_m + 2e-3, "{shortest_m} > {distance_m}");

        // All round, nothing is nearer either.
        let spec = task::Lidar { beam_count: 720, field_of_view_rad: TAU, ..spec };
        let mut lidar = Lidar::new(&spec);
        let round = lidar.cast(Pose::new(at.x, at.y, 0.0), &obstacles, std::iter::empty());
        prop_assert!(round.iter().all(|&range_m| range_m > distance_m - 1e-3));
    }

    #[test]
    fn a_footprint_collides_exactly_when_it_is_nearer_than_its_radius(
        world in prop_oneof![small_world(), large_world()],
        at in (-0.5..SIDE_M + 0.5, -0.5..SIDE_M + 0.5).prop_map(|(x, y)| Point::new(x, y)),
        radius_m in 0.05..0.6_f32,
    ) {
        let obstacles = Obstacles::new(&world);
        let distance_m = obstacles.distance_m(at, 20.0);
        prop_assume!((distance_m - radius_m).abs() > 1e-4);
        prop_assert_eq!(obstacles.collides(at, radius_m), distance_m < radius_m);
        prop_assert!(distance_m > 0.0 || obstacles.collides(at, 1e-3));
        prop_assert_eq!(world.bounds.contains(at) || distance_m <= 0.0, true);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn a_scan_of_a_large_world_is_that_of_brute_force(
        world in large_world(),
        spec in lidar(),
        at in place(30.0),
        yaw_rad in -PI..PI,
    ) {
        agrees(&world, &[], &spec, Pose::new(at.x, at.y, yaw_rad))?;
    }
}

#[test]
fn the_inside_of_a_polygon_collides_far_from_its_edges() {
    let corners = [(2.0, 2.0), (8.0, 2.0), (8.0, 8.0), (2.0, 8.0)].map(|(x, y)| Point::new(x, y));
    for vertices in [corners.to_vec(), corners.iter().rev().copied().collect()] {
        let world = World { polygons: vec![Polygon { vertices }], ..common::room(10.0) };
        let obstacles = Obstacles::new(&world);
        assert!(obstacles.collides(Point::new(5.0, 5.0), 0.2));
        assert!((obstacles.distance_m(Point::new(5.0, 5.5), 10.0) + 2.5).abs() < 1e-5);
        assert!(!obstacles.collides(Point::new(1.5, 5.0), 0.2));
    }
}

#[test]
fn no_beam_passes_between_walls_that_share_an_end() {
    // A closed ring of many short walls, beams straight at the shared ends.
    let end = |k: u16| {
        let angle_rad = f32::from(k) * TAU / 720.0;
        Point::new(5.0 + 3.0 * angle_rad.cos(), 5.0 + 3.0 * angle_rad.sin())
    };
    let segments = (0..720).map(|k| Segment { a: end(k), b: end((k + 1) % 720) }).collect();
    let world = World { segments, ..common::room(10.0) };
    let spec = task::Lidar { beam_count: 1440, range_max_m: 20.0, ..task::Lidar::default() };
    let mut lidar = Lidar::new(&spec);
    for k in 0..100_u8 {
        let pose = Pose::new(5.0 + 0.02 * f32::from(k), 5.0, 0.001 * f32::from(k));
        let ranges_m = lidar.cast(pose, &Obstacles::new(&world), std::iter::empty());
        let (x_m, far_m) = (pose.x_m - 5.0, ranges_m.iter().copied().fold(0.0, f32::max));
        assert!(far_m < 3.0 + x_m + 1e-3, "a beam left the ring: {far_m}");
    }
}
