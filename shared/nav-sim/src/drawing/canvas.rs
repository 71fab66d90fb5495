//! From metres to pixels, and the shapes a picture is made of.

use crate::world::Bounds;
use nav_core::footprint::Footprint;
use nav_core::geometry::{Point, Pose, Vector};
use std::fmt::{self, Write};

/// A finished part of a picture.
pub(super) struct Panel {
    pub(super) width: f32,
    pub(super) height: f32,
    pub(super) body: String,
}

/// SVG elements over a world: x to the right, y up, metres in, pixels out.
pub(super) struct Canvas {
    pub(super) svg: String,
    bounds: Bounds,
    left: f32,
    top: f32,
    /// Pixels a metre.
    pub(super) scale: f32,
}

impl Canvas {
    /// A canvas whose world fills `width` px, its upper left corner at (left, top).
    pub(super) fn new(bounds: Bounds, width: f32, left: f32, top: f32) -> Self {
        let size = bounds.max - bounds.min;
        // A tall world is not drawn larger than a square one.
        let scale = width / size.x.max(size.y).max(1e-3);
        Self { svg: String::new(), bounds, left: left + 0.5 * (width - size.x * scale), top, scale }
    }

    /// Height of the world, px.
    pub(super) fn height(&self) -> f32 {
        (self.bounds.max.y - self.bounds.min.y) * self.scale
    }

    fn px(&self, point: Point) -> (f32, f32) {
        (
            self.left + (point.x - self.bounds.min.x) * self.scale,
            self.top + (self.bounds.max.y - point.y) * self.scale,
        )
    }

    /// Appends one element.
    pub(super) fn push(&mut self, element: fmt::Arguments<'_>) {
        self.svg.write_fmt(element).expect("a string takes everything");
        self.svg.push('\n');
    }

    /// The floor of a world and its edge.
    pub(super) fn floor(&mut self, world: Bounds, fill: &str, edge: &str, edge_px: f32) {
        let (x, y) = self.px(Point::new(world.min.x, world.max.y));
        let width = (world.max.x - world.min.x) * self.scale;
        let height = (world.max.y - world.min.y) * self.scale;
        self.push(format_args!(
            r#"<rect x="{x:.1}" y="{y:.1}" width="{width:.1}" height="{height:.1}" fill="{fill}" stroke="{edge}" stroke-width="{edge_px:.1}"/>"#
        ));
    }

    /// A disc or ring; `radius_m` in metres.
    pub(super) fn circle(&mut self, center: Point, radius_m: f32, attributes: &str) {
        self.dot(center, radius_m * self.scale, attributes);
    }

    /// The outline of a robot at a pose.
    pub(super) fn footprint(&mut self, at: Pose, footprint: &Footprint, attributes: &str) {
        match footprint.corners() {
            None => self.circle(at.position(), footprint.circumradius_m(), attributes),
            Some(corners) => {
                self.polygon(corners.into_iter().map(|corner| at.parent_from_local(corner)), attributes);
            }
        }
    }

    /// A disc or ring; `radius_px` in pixels.
    pub(super) fn dot(&mut self, center: Point, radius_px: f32, attributes: &str) {
        let (x, y) = self.px(center);
        self.push(format_args!(r#"<circle cx="{x:.1}" cy="{y:.1}" r="{radius_px:.1}" {attributes}/>"#));
    }

    /// A small square about a point.
    pub(super) fn square(&mut self, center: Point, half_px: f32, attributes: &str) {
        let (x, y) = self.px(center);
        let side = 2.0 * half_px;
        self.push(format_args!(
            r#"<rect x="{:.1}" y="{:.1}" width="{side:.1}" height="{side:.1}" {attributes}/>"#,
            x - half_px,
            y - half_px
        ));
    }

    /// An open line through points; nothing for fewer than two.
    pub(super) fn line(&mut self, points: impl IntoIterator<Item = Point>, attributes: &str) {
        self.shape("polyline", points, attributes);
    }

    /// A closed shape.
    pub(super) fn polygon(&mut self, points: impl IntoIterator<Item = Point>, attributes: &str) {
        self.shape("polygon", points, attributes);
    }

    fn shape(&mut self, element: &str, points: impl IntoIterator<Item = Point>, attributes: &str) {
        let mut data = String::new();
        let mut count = 0;
        for (x, y) in points.into_iter().map(|point| self.px(point)) {
            write!(data, "{x:.1},{y:.1} ").expect("a string takes everything");
            count += 1;
        }
        if count > 1 {
            self.push(format_args!(r#"<{element} points="{}" {attributes}/>"#, data.trim_end()));
        }
    }

    /// A disc with a tick towards its heading.
    pub(super) fn heading(&mut self, center: Point, yaw_rad: f32, length_m: f32, attributes: &str) {
        let tip = center + Vector::new(libm::cosf(yaw_rad), libm::sinf(yaw_rad)) * length_m;
        self.line([center, tip], attributes);
    }
}
