//! A constant-velocity Kalman filter in the plane: position and velocity, whose acceleration is noise.

use crate::geometry::{Point, Vector};
use nalgebra::Matrix2;

/// Standard deviation of the acceleration of whoever walks, m/s².
const ACCELERATION_MPS2: f32 = 1.2;
/// Of a velocity nobody has measured yet, m/s.
const VELOCITY_SD_MPS: f32 = 0.8;

/// Estimate and covariance; the covariance in blocks: position, position with velocity, velocity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Filter {
    pub(super) position: Point,
    pub(super) velocity: Vector,
    pub(super) position_cov: Matrix2<f32>,
    pub(super) cross_cov: Matrix2<f32>,
    pub(super) velocity_cov: Matrix2<f32>,
}

impl Filter {
    /// At rest, as far as is known, where it was measured.
    pub(super) fn new(position: Point, position_cov: Matrix2<f32>) -> Self {
        Self {
            position,
            velocity: Vector::zeros(),
            position_cov,
            cross_cov: Matrix2::zeros(),
            velocity_cov: Matrix2::from_diagonal_element(VELOCITY_SD_MPS * VELOCITY_SD_MPS),
        }
    }

    /// Moves on for `dt_s`.
    pub(super) fn predict(&mut self, dt_s: f32) {
        self.position += self.velocity * dt_s;
        let noise = ACCELERATION_MPS2 * ACCELERATION_MPS2 * dt_s * dt_s;
        let one = Matrix2::identity();
        let crossed = self.cross_cov + self.cross_cov.transpose();
        self.position_cov +=
            crossed * dt_s + self.velocity_cov * (dt_s * dt_s) + one * (0.25 * noise * dt_s * dt_s);
        self.cross_cov += self.velocity_cov * dt_s + one * (0.5 * noise * dt_s);
        self.velocity_cov += one * noise;
    }

    /// Squared Mahalanobis distance of a measured position, and the determinant of its covariance, m^4.
    pub(super) fn distance2(&self, measured: Point, noise: &Matrix2<f32>) -> (f32, f32) {
        let spread = self.position_cov + noise;
        let determinant = spread.determinant();
        let off = measured - self.position;
        let crossed = spread.m22 * off.x * off.x - (spread.m12 + spread.m21) * off.x * off.y
            + spread.m11 * off.y * off.y;
        (if determinant > 0.0 { crossed / determinant } else { f32::INFINITY }, determinant)
    }

    /// Takes in a measured position.
    pub(super) fn update(&mut self, measured: Point, noise: &Matrix2<f32>) {
        let Some(inverse) = (self.position_cov + noise).try_inverse() else { return };
        let off = measured - self.position;
        let position_gain = self.position_cov * inverse;
        let velocity_gain = self.cross_cov.transpose() * inverse;
        self.position += position_gain * off;
        self.velocity += velocity_gain * off;
        self.velocity_cov -= velocity_gain * self.cross_cov;
        self.cross_cov -= position_gain * self.cross_cov;
        self.position_cov -= position_gain * self.position_cov;
        self.settle();
    }

    /// Somebody who turned or stopped within the last `dt_s`: the velocity is hardly known any more.
    pub(super) fn surprise(&mut self, dt_s: f32) {
        let one = Matrix2::identity() * (VELOCITY_SD_MPS * VELOCITY_SD_MPS);
        self.velocity_cov += one;
        self.cross_cov += one * dt_s;
        self.position_cov += one * (dt_s * dt_s);
    }

    /// Rounding must not make a covariance asymmetric or negative.
    fn settle(&mut self) {
        for cov in [&mut self.position_cov, &mut self.velocity_cov] {
            let off = 0.5 * (cov.m12 + cov.m21);
            cov.m11 = cov.m11.max(1e-6);
            cov.m22 = cov.m22.max(1e-6);
            let most = 0.99 * libm::sqrtf(cov.m11 * cov.m22);
            cov.m12 = off.clamp(-most, most);
            cov.m21 = cov.m12;
        }
    }

    /// Keeps the speed below what anybody walks, m/s.
    pub(super) fn limit_speed(&mut self, most_mps: f32) {
        let speed_mps = self.velocity.norm();
        if speed_mps > most_mps {
            self.velocity *= most_mps / speed_mps;
        }
    }
}
