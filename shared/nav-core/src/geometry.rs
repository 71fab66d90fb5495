//! Planar geometry: angles and poses. Counter-clockwise positive, x forward, radians and metres.

use crate::twist::Twist;
use core::f32::consts::{PI, TAU};
use nalgebra::{Point2, Vector2};

/// A point of the plane, m.
pub type Point = Point2<f32>;
/// A displacement, m, or a velocity, m/s.
pub type Vector = Vector2<f32>;

/// The same angle in (-π, π], rad.
pub fn wrap_angle(angle_rad: f32) -> f32 {
    if angle_rad > -PI && angle_rad <= PI {
        return angle_rad;
    }
    let wrapped = angle_rad - TAU * libm::floorf((angle_rad + PI) / TAU);
    if wrapped <= -PI { wrapped + TAU } else { wrapped }
}

/// Position and heading of a frame in a parent frame; as a map it is `parent_from_frame`.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
#[repr(C)]
pub struct Pose {
    /// Position along the parent's x axis, m.
    pub x_m: f32,
    /// Position along the parent's y axis, m.
    pub y_m: f32,
    /// Heading, counter-clockwise from the parent's x axis, rad in (-π, π].
    pub yaw_rad: f32,
}

impl Pose {
    /// A pose from position (m) and heading (rad).
    pub const fn new(x_m: f32, y_m: f32, yaw_rad: f32) -> Self {
        Self { x_m, y_m, yaw_rad }
    }

    /// The position, m.
    pub fn position(&self) -> Point {
        Point::new(self.x_m, self.y_m)
    }

    /// A point of this frame, in the parent frame.
    pub fn parent_from_local(&self, local: Point) -> Point {
        self.position() + rotated(local.coords, self.yaw_rad)
    }

    /// A point of the parent frame, in this frame.
    pub fn local_from_parent(&self, parent: Point) -> Point {
        Point::from(rotated(parent - self.position(), -self.yaw_rad))
    }

    /// A pose of this frame, in the parent frame: `parent_from_frame` after `frame_from_local`.
    pub fn after(&self, local: &Self) -> Self {
        let position = self.parent_from_local(local.position());
        Self { x_m: position.x, y_m: position.y, yaw_rad: wrap_angle(self.yaw_rad + local.yaw_rad) }
    }

    /// The parent in this frame: `frame_from_parent`.
    pub fn inverse(&self) -> Self {
        let origin = self.local_from_parent(Point::origin());
        Self { x_m: origin.x, y_m: origin.y, yaw_rad: wrap_angle(-self.yaw_rad) }
    }

    /// The direction from here to `target` in the parent frame, rad in (-π, π]; 0 for the same point.
    pub fn bearing_to(&self, target: Point) -> f32 {
        libm::atan2f(target.y - self.y_m, target.x - self.x_m)
    }

    /// The pose after moving with a constant velocity for `dt_s` along the exact arc.
    pub fn advanced(&self, velocity: Twist, dt_s: f32) -> Self {
        let turn_rad = velocity.angular_radps * dt_s;
        // sinc keeps the arc exact and smooth through zero turn.
        let half = 0.5 * turn_rad;
        let sinc = if half.abs() < 1e-4 { 1.0 - half * half / 6.0 } else { libm::sinf(half) / half };
        let chord_m = velocity.linear_mps * dt_s * sinc;
        let course_rad = self.yaw_rad + half;
        Self {
            x_m: self.x_m + chord_m * libm::cosf(course_rad),
            y_m: self.y_m + chord_m * libm::sinf(course_rad),
            yaw_rad: wrap_angle(self.yaw_rad + turn_rad),
        }
    }
}

/// A vector turned counter-clockwise. With libm: the same bits whatever features nalgebra is built with.
fn rotated(vector: Vector, angle_rad: f32) -> Vector {
    let (sin, cos) = libm::sincosf(angle_rad);
    Vector::new(cos * vector.x - sin * vector.y, sin * vector.x + cos * vector.y)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrapping_keeps_the_direction() {
        for k in -40..40_i16 {
            let angle = f32::from(k) * 0.37;
            let wrapped = wrap_angle(angle);
            assert!(wrapped > -PI && wrapped <= PI, "{wrapped}");
            assert!((libm::sinf(wrapped) - libm::sinf(angle)).abs() < 1e-5);
            assert!((libm::cosf(wrapped) - libm::cosf(angle)).abs() < 1e-5);
        }
    }

    #[test]
    fn local_and_parent_are_inverse() {
        let pose = Pose::new(1.0, -2.0, 0.7);
        let point = Point::new(0.3, 4.0);
        let back = pose.local_from_parent(pose.parent_from_local(point));
        assert!((back - point).norm() < 1e-5);
    }

    #[test]
    fn a_pose_after_its_inverse_is_nowhere() {
        let (pose, other) = (Pose::new(1.0, -2.0, 2.7), Pose::new(-0.4, 0.3, 1.9));
        let nowhere = pose.after(&pose.inverse());
        assert!(nowhere.position().coords.norm() < 1e-5 && nowhere.yaw_rad.abs() < 1e-5, "{nowhere:?}");
        let point = Point::new(0.7, 0.2);
        let one_by_one = pose.parent_from_local(other.parent_from_local(point));
        assert!((pose.after(&other).parent_from_local(point) - one_by_one).norm() < 1e-5);
    }

    #[test]
    fn a_full_circle_returns_home() {
        let mut pose = Pose::new(0.0, 0.0, 0.3);
        for _ in 0..100 {
            pose = pose.advanced(Twist::new(1.0, TAU / 10.0), 0.1);
        }
        assert!(pose.position().coords.norm() < 1e-3, "{pose:?}");
    }
}
