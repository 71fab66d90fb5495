//! Random streams: one generator, and independent seeds from one.

/// The generator of everything that is random: small, fast, and it can be saved.
pub type Rng = rand_xoshiro::Xoshiro256PlusPlus;

/// The seed of stream `index` of `seed` (SplitMix64's output function over both).
pub fn derive(seed: u64, index: u64) -> u64 {
    let mut z = seed.wrapping_add(index.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
