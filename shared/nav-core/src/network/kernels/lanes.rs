//! One vector register of each instruction level, behind one trait so that the kernels are written once.

#[cfg(target_arch = "x86_64")]
use core::arch::x86_64::*;

/// A register of `LANES` floats.
///
/// # Safety
/// Every function needs the level's instructions; `load` and `store` need `LANES` valid floats behind the pointer.
pub(super) trait Lanes {
    const LANES: usize;
    type Register: Copy;

    unsafe fn splat(value: f32) -> Self::Register;
    unsafe fn load(from: *const f32) -> Self::Register;
    unsafe fn store(to: *mut f32, value: Self::Register);
    unsafe fn add(a: Self::Register, b: Self::Register) -> Self::Register;
    /// `sum + a * b`
    unsafe fn multiply_add(sum: Self::Register, a: Self::Register, b: Self::Register) -> Self::Register;
}

/// Four floats in plain Rust; every 64-bit target has a register for them.
pub(super) struct Portable;

impl Lanes for Portable {
    const LANES: usize = 4;
    type Register = [f32; 4];

    #[inline(always)]
    unsafe fn splat(value: f32) -> [f32; 4] {
        [value; 4]
    }

    #[inline(always)]
    unsafe fn load(from: *const f32) -> [f32; 4] {
        // SAFETY: the caller vouches for four floats; an array of floats has a float's alignment.
        unsafe { from.cast::<[f32; 4]>().read() }
    }

    #[inline(always)]
    unsafe fn store(to: *mut f32, value: [f32; 4]) {
        // SAFETY: as in `load`.
        unsafe { to.cast::<[f32; 4]>().write(value) }
    }

    #[inline(always)]
    unsafe fn add(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
        core::array::from_fn(|i| a[i] + b[i])
    }

    #[inline(always)]
    unsafe fn multiply_add(sum: [f32; 4], a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
        core::array::from_fn(|i| sum[i] + a[i] * b[i])
    }
}

macro_rules! x86_lanes {
    ($(#[$doc:meta])* $name:ident, $lanes:literal, $register:ty, $splat:ident, $load:ident, $store:ident, $add:ident, $fma:ident) => {
        $(#[$doc])*
        #[cfg(target_arch = "x86_64")]
        pub(super) struct $name;

        #[cfg(target_arch = "x86_64")]
        impl Lanes for $name {
            const LANES: usize = $lanes;
            type Register = $register;

            #[inline(always)]
            unsafe fn splat(value: f32) -> $register {
                // SAFETY: the caller vouches for the instructions.
                unsafe { $splat(value) }
            }

            #[inline(always)]
            unsafe fn load(from: *const f32) -> $register {
                // SAFETY: the caller vouches for the instructions and the floats; the load needs no alignment.
                unsafe { $load(from) }
            }

            #[inline(always)]
            unsafe fn store(to: *mut f32, value: $register) {
                // SAFETY: as in `load`.
                unsafe { $store(to, value) }
            }

            #[inline(always)]
            unsafe fn add(a: $register, b: $register) -> $register {
                // SAFETY: the caller vouches for the instructions.
                unsafe { $add(a, b) }
            }

            #[inline(always)]
            unsafe fn multiply_add(sum: $register, a: $register, b: $register) -> $register {
                // SAFETY: the caller vouches for the instructions.
                unsafe { $fma(a, b, sum) }
            }
        }
    };
}

x86_lanes!(
    /// Eight floats, fused multiply-add.
    Avx2, 8, __m256, _mm256_set1_ps, _mm256_loadu_ps, _mm256_storeu_ps, _mm256_add_ps, _mm256_fmadd_ps
);
x86_lanes!(
    /// Sixteen floats, fused multiply-add.
    Avx512, 16, __m512, _mm512_set1_ps, _mm512_loadu_ps, _mm512_storeu_ps, _mm512_add_ps, _mm512_fmadd_ps
);
