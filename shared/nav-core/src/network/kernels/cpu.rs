//! Which vector instructions this processor has, asked of the processor itself (there is no `std` here to ask).

use core::fmt;

/// An instruction level. The order is from slow to fast.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum CpuLevel {
    /// What every machine has: four lanes, no fused multiply-add (SSE2 on x86-64, NEON on 64-bit Arm).
    Portable,
    /// x86-64 with AVX2 and FMA: eight lanes.
    Avx2,
    /// x86-64 with AVX-512F: sixteen lanes.
    Avx512,
}

impl CpuLevel {
    /// The fastest level of this machine.
    pub fn detect() -> Self {
        [Self::Avx512, Self::Avx2].into_iter().find(|level| level.is_available()).unwrap_or(Self::Portable)
    }

    /// Whether processor and operating system support this level.
    pub fn is_available(self) -> bool {
        match self {
            Self::Portable => true,
            Self::Avx2 => has_avx2(),
            Self::Avx512 => has_avx2() && has_avx512(),
        }
    }
}

impl fmt::Display for CpuLevel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Portable => "portable",
            Self::Avx2 => "AVX2+FMA",
            Self::Avx512 => "AVX-512",
        })
    }
}

#[cfg(not(target_arch = "x86_64"))]
fn has_avx2() -> bool {
    false
}

#[cfg(not(target_arch = "x86_64"))]
fn has_avx512() -> bool {
    false
}

#[cfg(target_arch = "x86_64")]
fn has_avx2() -> bool {
    const FMA: u32 = 1 << 12;
    const OSXSAVE: u32 = 1 << 27;
    const AVX: u32 = 1 << 28;
    const AVX2: u32 = 1 << 5;
    const XMM_AND_YMM_STATE: u64 = 0b110;

    let needed = FMA | OSXSAVE | AVX;
    core::arch::x86_64::__cpuid(0).eax >= 7
        && core::arch::x86_64::__cpuid(1).ecx & needed == needed
        && core::arch::x86_64::__cpuid_count(7, 0).ebx & AVX2 != 0
        && saved_state() & XMM_AND_YMM_STATE == XMM_AND_YMM_STATE
}

/// Call only after [`has_avx2`].
#[cfg(target_arch = "x86_64")]
fn has_avx512() -> bool {
    const AVX512F: u32 = 1 << 16;
    const MASK_AND_ZMM_STATE: u64 = 0b1110_0000;

    core::arch::x86_64::__cpuid_count(7, 0).ebx & AVX512F != 0
        && saved_state() & MASK_AND_ZMM_STATE == MASK_AND_ZMM_STATE
}

/// The register kinds that the operating system saves. Only read after `cpuid` told that `xgetbv` exists.
#[cfg(target_arch = "x86_64")]
fn saved_state() -> u64 {
    const OSXSAVE: u32 = 1 << 27;
    if core::arch::x86_64::__cpuid(1).ecx & OSXSAVE == 0 {
        return 0;
    }
    // SAFETY: `cpuid` says that the operating system has enabled the instruction.
    unsafe { core::arch::x86_64::_xgetbv(0) }
}
