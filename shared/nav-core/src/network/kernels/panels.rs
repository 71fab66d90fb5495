//! The matrix-vector product over packed panels, generic over the register.
//!
//! # Safety
//! Every function needs the instructions of `L`. Pointers are derived from the slices of a [`Linear`] whose lengths
//! `Kernels::linear` has checked, and stay inside them: the packed matrix is walked exactly once, as `pack` laid it out.

use super::lanes::Lanes;
use super::{Linear, aligned};

/// Panel widths in registers, widest first. After the widest, each occurs at most once.
pub(super) const REGISTERS: [usize; 4] = [8, 4, 2, 1];

/// The widest register of any level.
const MAX_LANES: usize = 16;

/// `y[r] = x[r] * weights^T + bias` for each row of the job.
#[inline(always)]
pub(super) unsafe fn linear<L: Lanes>(job: &Linear<'_>, y: &mut [f32]) {
    let mut place =
        Place { packed: job.packed.as_ptr(), weights: aligned(job.outputs), column: 0, y: y.as_mut_ptr() };
    // SAFETY: see the module; the widths below add up to `outputs`.
    unsafe {
        while job.outputs - place.column >= 8 * L::LANES {
            panel::<L, 8, 1>(job, &mut place);
        }
        if job.outputs - place.column >= 4 * L::LANES {
            panel::<L, 4, 2>(job, &mut place);
        }
        if job.outputs - place.column >= 2 * L::LANES {
            panel::<L, 2, 4>(job, &mut place);
        }
        if job.outputs - place.column >= L::LANES {
            panel::<L, 1, 8>(job, &mut place);
        }
        while place.column < job.outputs {
            single::<L>(job, &mut place);
        }
    }
}

/// Where the walk over the packed matrix stands.
struct Place {
    packed: *const f32,
    /// Offset of the next panel.
    weights: usize,
    /// The next output.
    column: usize,
    y: *mut f32,
}

/// One panel of `WIDTH` registers for all rows; `DEPTH` inputs at once, so that eight sums are in flight.
#[inline(always)]
unsafe fn panel<L: Lanes, const WIDTH: usize, const DEPTH: usize>(job: &Linear<'_>, place: &mut Place) {
    let columns = WIDTH * L::LANES;
    // SAFETY: see the module.
    unsafe {
        let weights = place.packed.add(place.weights);
        let bias = place.packed.add(place.column);
        for row in 0..job.rows {
            let x = job.x.as_ptr().add(row * job.x_stride);
            let y = place.y.add(row * job.y_stride + place.column);
            let mut sums = [[L::splat(0.0); WIDTH]; DEPTH];
            for (register, sum) in sums[0].iter_mut().enumerate() {
                *sum = L::load(bias.add(register * L::LANES));
            }
            let mut input = 0;
            while input + DEPTH <= job.inputs {
                for (depth, sums) in sums.iter_mut().enumerate() {
                    accumulate::<L, WIDTH>(
                        sums,
                        *x.add(input + depth),
                        weights.add((input + depth) * columns),
                    );
                }
                input += DEPTH;
            }
            while input < job.inputs {
                accumulate::<L, WIDTH>(&mut sums[0], *x.add(input), weights.add(input * columns));
                input += 1;
            }
            for (register, total) in fold::<L, WIDTH, DEPTH>(sums).into_iter().enumerate() {
                L::store(y.add(register * L::LANES), total);
            }
        }
    }
    place.weights += columns * job.inputs;
    place.column += columns;
}

/// `sums += x * weights[0..WIDTH registers]`
#[inline(always)]
unsafe fn accumulate<L: Lanes, const WIDTH: usize>(
    sums: &mut [L::Register; WIDTH],
    x: f32,
    weights: *const f32,
) {
    // SAFETY: see the module.
    unsafe {
        let x = L::splat(x);
        for (register, sum) in sums.iter_mut().enumerate() {
            *sum = L::multiply_add(*sum, x, L::load(weights.add(register * L::LANES)));
        }
    }
}

/// The sum of `DEPTH` (a power of two) partial sums, by halves.
#[inline(always)]
unsafe fn fold<L: Lanes, const WIDTH: usize, const DEPTH: usize>(
    mut sums: [[L::Register; WIDTH]; DEPTH],
) -> [L::Register; WIDTH] {
    let mut half = DEPTH / 2;
    while half > 0 {
        let (low, high) = sums.split_at_mut(half);
        for (low, high) in low.iter_mut().flatten().zip(high.iter().flatten()) {
            // SAFETY: needs the instructions only.
            *low = unsafe { L::add(*low, *high) };
        }
        half /= 2;
    }
    sums[0]
}

/// One output as a dot product for all rows.
#[inline(always)]
unsafe fn single<L: Lanes>(job: &Linear<'_>, place: &mut Place) {
    // SAFETY: see the module; the stored row is padded to whole registers.
    unsafe {
        let weights = place.packed.add(place.weights);
        let bias = *place.packed.add(place.column);
        for row in 0..job.rows {
            let x = job.x.as_ptr().add(row * job.x_stride);
            *place.y.add(row * job.y_stride + place.column) = bias + dot::<L>(x, weights, job.inputs);
        }
    }
    place.weights += job.inputs.next_multiple_of(L::LANES);
    place.column += 1;
}

/// The dot product of `inputs` floats of `x` with a row that is padded with zeros to whole registers.
#[inline(always)]
unsafe fn dot<L: Lanes>(x: *const f32, weights: *const f32, inputs: usize) -> f32 {
    const DEPTH: usize = 4;
    // SAFETY: see the module; what is past the end of `x` is read from `padded` instead.
    unsafe {
        let mut sums = [[L::splat(0.0); 1]; DEPTH];
        let mut input = 0;
        while input + DEPTH * L::LANES <= inputs {
            for (depth, sums) in sums.iter_mut().enumerate() {
                let at = input + depth * L::LANES;
                sums[0] = L::multiply_add(sums[0], L::load(x.add(at)), L::load(weights.add(at)));
            }
            input += DEPTH * L::LANES;
        }
        while input + L::LANES <= inputs {
            sums[0][0] = L::multiply_add(sums[0][0], L::load(x.add(input)), L::load(weights.add(input)));
            input += L::LANES;
        }
        if input < inputs {
            let mut padded = [0.0; MAX_LANES];
            for (offset, slot) in padded.iter_mut().enumerate().take(inputs - input) {
                *slot = *x.add(input + offset);
            }
            sums[1][0] = L::multiply_add(sums[1][0], L::load(padded.as_ptr()), L::load(weights.add(input)));
        }
        let mut lanes = [0.0; MAX_LANES];
        L::store(lanes.as_mut_ptr(), fold::<L, 1, DEPTH>(sums)[0]);
        let mut half = L::LANES / 2;
        while half > 0 {
            for lane in 0..half {
                lanes[lane] += lanes[lane + half];
            }
            half /= 2;
        }
        lanes[0]
    }
}
