//! Element-wise passes of the network, compiled twice: for any x86-64 and for AVX2.
//!
//! No reduction here is re-ordered by the compiler and no multiply-add is fused, so both versions give the
//! same bits.

/// Declares a function whose body is compiled for the baseline and for AVX2, and picks one when called.
macro_rules! vectorised {
    ($(#[$attribute:meta])* $visibility:vis fn $name:ident($($argument:ident: $kind:ty),* $(,)?) $body:block) => {
        $(#[$attribute])*
        $visibility fn $name($($argument: $kind),*) {
            #[inline(always)]
            #[allow(clippy::too_many_arguments, reason = "the outer function answers for its arguments")]
            fn body($($argument: $kind),*) $body
            #[cfg(target_arch = "x86_64")]
            {
                #[target_feature(enable = "avx2")]
                #[allow(clippy::too_many_arguments, reason = "the outer function answers for its arguments")]
                fn with_avx2($($argument: $kind),*) {
                    body($($argument),*);
                }
                if std::arch::is_x86_feature_detected!("avx2") {
                    // SAFETY: the processor has AVX2, which is all the function asks for.
                    return unsafe { with_avx2($($argument),*) };
                }
            }
            body($($argument),*);
        }
    };
}
pub(crate) use vectorised;

vectorised! {
    /// `values[r][c] = max(values[r][c] + bias[c], 0)`.
    pub(crate) fn add_bias_relu(values: &mut [f32], bias: &[f32]) {
        for row in values.chunks_exact_mut(bias.len()) {
            for (value, bias) in row.iter_mut().zip(bias) {
                *value = (*value + bias).max(0.0);
            }
        }
    }
}

vectorised! {
    /// `values[r][c] += bias[c]`.
    pub(crate) fn add_bias(values: &mut [f32], bias: &[f32]) {
        for row in values.chunks_exact_mut(bias.len()) {
            for (value, bias) in row.iter_mut().zip(bias) {
                *value += bias;
            }
        }
    }
}

vectorised! {
    /// Derivative of the rectifier, in place: a gradient passes where the activation is positive.
    pub(crate) fn relu_backward(gradient: &mut [f32], activation: &[f32]) {
        for (gradient, activation) in gradient.iter_mut().zip(activation) {
            *gradient = if *activation > 0.0 { *gradient } else { 0.0 };
        }
    }
}

vectorised! {
    /// `sums[c] += sum over rows of values[r][c]`.
    pub(crate) fn add_column_sums(sums: &mut [f32], values: &[f32]) {
        for row in values.chunks_exact(sums.len()) {
            for (sum, value) in sums.iter_mut().zip(row) {
                *sum += value;
            }
        }
    }
}

/// Lanes of a sum.
const LANES: usize = 16;

/// Sum of `term(a[i], b[i])` in sixteen fixed lanes: vectorises, and gives the same bits on every processor.
#[inline(always)]
pub(crate) fn lane_sum(a: &[f32], b: &[f32], term: impl Fn(f32, f32) -> f32) -> f32 {
    let mut lanes = [0.0_f32; LANES];
    let (whole_a, rest_a) = a.as_chunks::<LANES>();
    let (whole_b, rest_b) = b.as_chunks::<LANES>();
    for (a, b) in whole_a.iter().zip(whole_b) {
        for ((sum, a), b) in lanes.iter_mut().zip(a).zip(b) {
            *sum += term(*a, *b);
        }
    }
    let mut total = 0.0;
    for (a, b) in rest_a.iter().zip(rest_b) {
        total += term(*a, *b);
    }
    for half in [8, 4, 2, 1] {
        for lane in 0..half {
            lanes[lane] += lanes[lane + half];
        }
    }
    total + lanes[0]
}
