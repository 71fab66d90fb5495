//! Axes: values to pixels, and round numbers to label them with.

use super::canvas::{Anchor, Canvas, FAINT, GRID};

/// Values `from` to `to` on pixels `start` to `end`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axis {
    from: f64,
    to: f64,
    start: f64,
    end: f64,
}

impl Axis {
    /// An axis over a range that is widened where it is empty.
    pub(super) fn new((from, to): (f64, f64), (start, end): (f64, f64)) -> Self {
        let to = if to > from { to } else { from + 1.0 };
        Self { from, to, start, end }
    }

    /// Where a value lies; what is outside, at the end.
    pub(super) fn at(&self, value: f64) -> f64 {
        let share = ((value - self.from) / (self.to - self.from)).clamp(0.0, 1.0);
        self.start + share * (self.end - self.start)
    }

    /// Round values on the axis, about `count` of them.
    pub(super) fn ticks(&self, count: usize) -> Vec<f64> {
        let rough = (self.to - self.from) / count.max(1) as f64;
        let power = 10.0_f64.powf(rough.log10().floor());
        let steps = [1.0, 2.0, 2.5, 5.0, 10.0].map(|factor| factor * power);
        let step = steps.into_iter().find(|&step| step >= rough * 0.999).unwrap_or(10.0 * power);
        let first = (self.from / step - 1e-9).ceil() as i64;
        let last = (self.to / step + 1e-9).floor() as i64;
        (first..=last).map(|index| index as f64 * step).collect()
    }

    /// Vertical lines and labels of a horizontal axis whose panel reaches from `top` to `bottom`.
    pub(super) fn draw_below(&self, canvas: &mut Canvas, (top, bottom): (f64, f64), count: usize) {
        for tick in self.ticks(count) {
            let x = self.at(tick);
            canvas.line((x, top), (x, bottom), GRID, 1.0);
            canvas.text(&label(tick), (x, bottom + 16.0), Anchor::Middle).color = FAINT;
        }
    }

    /// Horizontal lines and labels of a vertical axis whose panel reaches from `left` to `right`.
    pub(super) fn draw_left(&self, canvas: &mut Canvas, (left, right): (f64, f64), count: usize) {
        for tick in self.ticks(count) {
            let y = self.at(tick);
            canvas.line((left, y), (right, y), GRID, 1.0);
            canvas.text(&label(tick), (left - 6.0, y + 4.5), Anchor::End).color = FAINT;
        }
    }
}

/// A number as short as it is exact to three places; none below zero that rounds to it.
fn label(value: f64) -> String {
    let text = format!("{value:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_within() {
        let ticks = |from, to, count| Axis::new((from, to), (0.0, 100.0)).ticks(count);
        assert_eq!(ticks(0.0, 100.0, 5), [0.0, 20.0, 40.0, 60.0, 80.0, 100.0]);
        assert_eq!(ticks(0.0, 1.3, 4).iter().map(|tick| label(*tick)).collect::<Vec<_>>(), ["0", "0.5", "1"]);
        assert_eq!(ticks(-7.0, 12.0, 4), [-5.0, 0.0, 5.0, 10.0]);
        assert_eq!(label(-0.000_01), "0");
    }

    #[test]
    fn values_outside_lie_at_the_end() {
        let axis = Axis::new((0.0, 10.0), (200.0, 100.0));
        let places = [-5.0, 0.0, 5.0, 99.0].map(|value| axis.at(value).round() as i32);
        assert_eq!(places, [200, 200, 150, 100]);
    }
}
