//! The comparison of the lowered network with tract that every model passes before it may drive.

use super::{Arena, LoadError, TractOracle};
use nav_core::network::Network;

/// Inputs that are compared: zeros, then noise of three sizes.
pub const PARITY_CASES: usize = 25;

/// The largest allowed difference, relative to the larger of one and the largest of tract's results for the same input.
pub const PARITY_TOLERANCE: f32 = 1e-5;

/// The largest difference over all cases.
pub(super) fn compare(network: &mut Network<Arena>, oracle: &TractOracle) -> Result<f32, LoadError> {
    let mut noise = Noise(0x9E37_79B9_7F4A_7C15);
    let mut input = vec![0.0; network.input_len()];
    let mut output = vec![0.0; network.output_len()];
    let mut worst = 0.0_f32;
    for case in 0..PARITY_CASES {
        let scale = if case == 0 { 0.0 } else { [0.1, 1.0, 3.0][case % 3] };
        input.fill_with(|| scale * noise.next());
        network.run(&input, &mut output);
        let expected = oracle.run(&input)?;
        // Rounding grows with the largest number of a layer, not with a result that happens to be small.
        let size = expected.iter().fold(1.0_f32, |size, value| size.max(value.abs()));
        for (found, expected) in output.iter().zip(&expected) {
            let difference = (found - expected).abs() / size;
            if difference.is_nan() || difference > PARITY_TOLERANCE {
                return Err(LoadError::Parity { difference, case, tolerance: PARITY_TOLERANCE });
            }
            worst = worst.max(difference);
        }
    }
    Ok(worst)
}

/// A fixed sequence of numbers in `[-1, 1)` (xorshift).
struct Noise(u64);

impl Noise {
    #[expect(clippy::cast_precision_loss, reason = "24 bits fit a float")]
    fn next(&mut self) -> f32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 40) as f32 / (1 << 23) as f32 - 1.0
    }
}
