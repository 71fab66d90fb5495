//! What was some ticks ago, in memory of fixed size.

/// The newest value of each tick and those before it, so many ticks back.
#[derive(Clone, Debug)]
pub(crate) struct History<T, const N: usize> {
    values: [T; N],
    /// How many of the places are used: the ticks back, and the present.
    used: usize,
    newest: usize,
}

impl<T: Copy, const N: usize> History<T, N> {
    /// The same value at all times, `ticks` back; as far as there is room.
    pub(crate) fn new(ticks: u32, value: T) -> Self {
        Self { values: [value; N], used: (ticks as usize + 1).min(N), newest: 0 }
    }

    /// The same value at all times.
    pub(crate) fn fill(&mut self, value: T) {
        self.values[..self.used].fill(value);
    }

    /// A tick later.
    pub(crate) fn push(&mut self, value: T) {
        self.newest = (self.newest + 1) % self.used;
        self.values[self.newest] = value;
    }

    /// The value of now.
    pub(crate) fn newest(&self) -> &T {
        &self.values[self.newest]
    }

    /// The value of so many ticks ago as are kept.
    pub(crate) fn oldest(&self) -> &T {
        &self.values[(self.newest + 1) % self.used]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_is_as_old_as_it_says() {
        for (ticks, expected) in [(1, 8), (3, 6), (7, 2), (90, 2)] {
            let mut history = History::<u32, 8>::new(ticks, 0);
            (1..=9).for_each(|tick| history.push(tick));
            assert_eq!((*history.newest(), *history.oldest()), (9, expected));
            history.fill(5);
            assert_eq!(*history.oldest(), 5);
        }
    }
}
