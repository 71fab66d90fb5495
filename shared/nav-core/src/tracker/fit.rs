//! Where the centre of a round thing lies, from the few points of its surface that were hit.

use crate::geometry::{Point, Vector};
use nalgebra::Matrix2;

/// Standard deviation of a range and of a body's roundness, m.
const SURFACE_SD_M: f32 = 0.03;
/// As many points of a surface are looked at: more tell little more, because a body is not exactly round.
pub(super) const POINTS_MAX: usize = 8;
/// Rounds of Gauss-Newton.
const ROUNDS: usize = 2;

/// What is known before the surface is looked at, robot frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Guess {
    pub(super) center: Point,
    pub(super) radius_m: f32,
    /// Standard deviation along the line of sight, m...
    pub(super) along_sd_m: f32,
    /// ...and across it, m.
    pub(super) across_sd_m: f32,
}

/// A centre with its covariance, robot frame, m and m².
#[derive(Clone, Copy, Debug)]
pub(super) struct Fit {
    pub(super) center: Point,
    pub(super) cov: Matrix2<f32>,
}

/// The centre that suits both the guess and the points best, in the sense of least squares.
pub(super) fn fitted(guess: &Guess, points: &[Point]) -> Fit {
    let sight = guess.center.coords;
    let distance_m = sight.norm().max(1e-3);
    let along = sight / distance_m;
    let across = Vector::new(-along.y, along.x);
    let prior = outer(along) / (guess.along_sd_m * guess.along_sd_m)
        + outer(across) / (guess.across_sd_m * guess.across_sd_m);
    let weight = 1.0 / (SURFACE_SD_M * SURFACE_SD_M);
    let mut center = guess.center;
    let mut information = prior;
    for _ in 0..ROUNDS {
        information = prior;
        let mut pull = prior * (guess.center - center);
        for point in points {
            let to_center = center - point;
            let far_m = to_center.norm();
            if far_m < 1e-3 {
                continue;
            }
            let normal = to_center / far_m;
            information += outer(normal) * weight;
            pull += normal * ((guess.radius_m - far_m) * weight);
        }
        let Some(cov) = information.try_inverse() else { break };
        center += cov * pull;
    }
    let cov = information.try_inverse().unwrap_or_else(Matrix2::identity);
    Fit { center, cov }
}

fn outer(unit: Vector) -> Matrix2<f32> {
    unit * unit.transpose()
}
