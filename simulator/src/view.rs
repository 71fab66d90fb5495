//! A map in the terminal, redrawn in place: two by four dots a character. It fits the terminal, whatever its size.
//!
//! | mark | meaning |
//! |---|---|
//! | arrow in an outline, `X` | the robot, the goal |
//! | `O`, `o` | people whom the safety gate follows as moving, and others |
//! | dots before an `O` | where the gate believes them to walk in the next second |

use nav_core::geometry::Point;
use nav_core::messages::fault;
use nav_host::terminal;
use nav_sim::drawing::Seen;
use nav_sim::simulation::Simulation;
use nav_sim::world::Bounds;
use std::time::{Duration, Instant};

/// The widest map, characters; the height follows the world's shape.
const COLUMNS_MAX: usize = 56;
/// The tallest map, lines.
const ROWS_MAX: usize = 34;
/// Lines of words below the map.
const WORDS: usize = 3;
/// Somebody this near to a track is followed, m.
const FOLLOWED_M: f32 = 0.5;
/// Dots of the way that somebody is believed to walk in a second.
const AHEAD_DOTS: u8 = 8;
/// Pictures come no faster than this.
const FRAME: Duration = Duration::from_millis(100);

/// The picture of an episode: what does not move is drawn once.
#[derive(Debug, Default)]
pub(crate) struct View {
    canvas: Canvas,
    walls: Vec<u8>,
    trail: Vec<Point>,
    /// Columns and lines of the terminal.
    size: (usize, usize),
    drawn_lines: usize,
    last_frame: Option<Instant>,
}

#[derive(Debug, Default)]
struct Canvas {
    min: Point,
    dot_m: f32,
    columns: usize,
    rows: usize,
    dots: Vec<u8>,
    marks: Vec<Option<char>>,
}

impl Canvas {
    /// For a terminal of so many columns and lines.
    fn over(bounds: &Bounds, (columns, lines): (usize, usize)) -> Self {
        // The last column stays empty, lest a terminal begins a line of its own; the cursor stands below the words.
        let columns = columns.saturating_sub(1).clamp(1, COLUMNS_MAX);
        let rows_max = lines.saturating_sub(WORDS + 1).clamp(1, ROWS_MAX);
        let size = bounds.max - bounds.min;
        let dot_m = (size.x / (2 * columns) as f32).max(size.y / (4 * rows_max) as f32).max(1e-3);
        let rows = ((size.y / dot_m / 4.0).ceil() as usize).clamp(1, rows_max);
        Self {
            min: bounds.min,
            dot_m,
            columns,
            rows,
            dots: vec![0; columns * rows],
            marks: vec![None; columns * rows],
        }
    }

    /// Character and bit of a point, if it lies on the canvas.
    fn locate(&self, point: Point) -> Option<(usize, u8)> {
        let offset = (point - self.min) / self.dot_m;
        if offset.x < 0.0 || offset.y < 0.0 {
            return None;
        }
        let (x, y) = (offset.x as usize, offset.y as usize);
        if x >= 2 * self.columns || y >= 4 * self.rows {
            return None;
        }
        let y = 4 * self.rows - 1 - y;
        // Unicode braille: dots 1-3 and 7 on the left, 4-6 and 8 on the right.
        let bit = [[0, 3], [1, 4], [2, 5], [6, 7]][y % 4][x % 2];
        Some((y / 4 * self.columns + x / 2, 1 << bit))
    }

    fn dot(&mut self, point: Point) {
        if let Some((cell, bit)) = self.locate(point) {
            self.dots[cell] |= bit;
        }
    }

    fn mark(&mut self, point: Point, symbol: char) {
        if let Some((cell, _)) = self.locate(point) {
            self.marks[cell] = Some(symbol);
        }
    }

    fn text(&self) -> String {
        let mut text = String::new();
        for row in 0..self.rows {
            for cell in row * self.columns..(row + 1) * self.columns {
                let braille = char::from_u32(0x2800 + u32::from(self.dots[cell])).unwrap_or(' ');
                text.push(self.marks[cell].unwrap_or(braille));
            }
            text.push_str("\x1b[K\n");
        }
        text
    }
}

impl View {
    /// A new world: its walls are found once.
    pub(crate) fn begin(&mut self, simulation: &Simulation) {
        self.trail.clear();
        self.last_frame = None;
        self.fit(simulation, terminal::size());
    }

    fn fit(&mut self, simulation: &Simulation, size: (usize, usize)) {
        self.size = size;
        self.canvas = Canvas::over(&simulation.world().bounds, size);
        let dot_m = self.canvas.dot_m;
        for y in 0..4 * self.canvas.rows {
            for x in 0..2 * self.canvas.columns {
                let point = Point::new(
                    self.canvas.min.x + (x as f32 + 0.5) * dot_m,
                    self.canvas.min.y + (y as f32 + 0.5) * dot_m,
                );
                // Half a dot's diagonal: no thin wall slips between the centres.
                if simulation.obstacles().collides(point, 0.75 * dot_m) {
                    self.canvas.dot(point);
                }
            }
        }
        self.walls = self.canvas.dots.clone();
    }

    /// Draws the present moment over the last picture, if it is time for one or the episode is over.
    pub(crate) fn show(&mut self, simulation: &Simulation, seen: &Seen, faults: u32, over: bool) {
        self.trail.push(simulation.pose().position());
        if !over && self.last_frame.is_some_and(|last| last.elapsed() < FRAME) {
            return;
        }
        let size = terminal::size();
        if size != self.size {
            // Nobody knows where the last picture stands now.
            self.fit(simulation, size);
            self.drawn_lines = 0;
        }
        let picture = self.picture(simulation, seen, faults);
        let lines = picture.matches('\n').count();
        // Back to the first line of the last picture.
        let back = if self.drawn_lines > 0 { format!("\x1b[{}A", self.drawn_lines) } else { String::new() };
        if terminal::draw(back + &picture) {
            self.last_frame = Some(Instant::now());
            self.drawn_lines = lines;
        }
        if over {
            self.drawn_lines = 0;
        }
    }

    fn picture(&mut self, simulation: &Simulation, seen: &Seen, faults: u32) -> String {
        self.canvas.dots.clone_from(&self.walls);
        self.canvas.marks.fill(None);
        for point in self.trail.iter().copied().chain(simulation.body().outline()) {
            self.canvas.dot(point);
        }
        self.canvas.mark(simulation.world().goal, 'X');
        let moving = || seen.tracks.iter().filter(|track| track.velocity.norm() > 0.0);
        for track in moving() {
            for part in 1..=AHEAD_DOTS {
                self.canvas.dot(track.position + track.velocity * (f32::from(part) / f32::from(AHEAD_DOTS)));
            }
        }
        for person in simulation.people() {
            let is_followed = moving().any(|track| (track.position - person.position).norm() < FOLLOWED_M);
            self.canvas.mark(person.position, if is_followed { 'O' } else { 'o' });
        }
        let pose = simulation.pose();
        self.canvas.mark(pose.position(), arrow(pose.yaw_rad));
        let to_goal_m = (simulation.world().goal - pose.position()).norm();
        let words = [
            format!("{:5.1} s  {}", simulation.time_s(), terminal::one_line(&simulation.world().name)),
            format!(
                "goal {to_goal_m:.1} m  v {:.2} m/s  w {:+.2} rad/s  faults {faults:#x}",
                seen.command.linear_mps, seen.command.angular_radps
            ),
            format!(
                "wished     v {:.2} m/s  w {:+.2} rad/s{}",
                seen.wish.linear_mps,
                seen.wish.angular_radps,
                if faults & fault::SHIELDED == 0 { "" } else { "  shield acts" }
            ),
        ];
        let mut text = self.canvas.text();
        for line in words {
            text.push_str(clipped(&line, self.size.0.saturating_sub(1)));
            text.push_str("\x1b[K\n");
        }
        text
    }
}

/// As much of a line as fits into so many columns; what is not ASCII may take two.
fn clipped(line: &str, columns: usize) -> &str {
    let mut left = columns;
    let end = line.char_indices().find_map(|(at, letter)| {
        let width = if letter.is_ascii() { 1 } else { 2 };
        left = left.checked_sub(width).unwrap_or(usize::MAX);
        (left == usize::MAX).then_some(at)
    });
    &line[..end.unwrap_or(line.len())]
}

fn arrow(yaw_rad: f32) -> char {
    let eighths = (yaw_rad / std::f32::consts::FRAC_PI_4).round() as i32;
    ['→', '↗', '↑', '↖', '←', '↙', '↓', '↘'][eighths.rem_euclid(8) as usize]
}

#[cfg(test)]
mod tests {
    use super::*;
    use nav_core::geometry::Vector;
    use nav_core::task::Task;
    use nav_core::twist::Twist;
    use nav_sim::disturbance::Disturbance;
    use nav_sim::families::{Family, Split, generate};
    use nav_sim::people::PersonState;
    use std::sync::Arc;

    /// Nothing seen, everything as wished.
    fn seen(command: Twist) -> Seen {
        Seen { hits: Vec::new(), tracks: Vec::new(), wish: command, command, intervention: None }
    }

    #[test]
    fn the_picture_shows_who_is_followed_and_what_was_wished() {
        let world = Arc::new(generate(Family::Crowd, Split::Test, 1));
        let simulation = Simulation::new(world, &Task::default(), &Disturbance::none(), 1);
        let mut view = View::default();
        view.begin(&simulation);
        view.fit(&simulation, (80, 60));
        let nobody = view.picture(&simulation, &seen(Twist::ZERO), 0);
        assert!(!nobody.contains('O') && !nobody.contains("shield acts"), "{nobody}");
        let person = simulation.people()[0];
        let track = PersonState { velocity: Vector::new(1.0, 0.0), ..person };
        let all = Seen { tracks: vec![track], wish: Twist::new(0.75, 0.5), ..seen(Twist::ZERO) };
        let followed = view.picture(&simulation, &all, fault::SHIELDED);
        assert!(followed.contains('O'), "{followed}");
        assert!(followed.contains("wished     v 0.75 m/s  w +0.50 rad/s  shield acts"), "{followed}");
        let dots = |picture: &str| picture.chars().filter(|c| ('\u{2801}'..='\u{28ff}').contains(c)).count();
        assert!(dots(&followed) > dots(&nobody), "where they walk: {followed}");
    }

    #[test]
    fn the_picture_shows_walls_robot_and_goal() {
        // Thin walls on round numbers, which lie exactly between two dots.
        let world = Arc::new(generate(Family::Maze, Split::Test, 1));
        let simulation = Simulation::new(world, &Task::default(), &Disturbance::none(), 1);
        let mut view = View::default();
        view.begin(&simulation);
        let picture = view.picture(&simulation, &seen(Twist::ZERO), 0);
        assert!(picture.contains('X'), "{picture}");
        assert!(picture.chars().any(|c| "→↗↑↖←↙↓↘".contains(c)), "{picture}");
        let dots = picture.chars().filter(|c| ('\u{2801}'..='\u{28ff}').contains(c)).count();
        assert!(dots > 200, "walls are drawn: {picture}");
    }

    #[test]
    fn up_is_up_and_left_is_left() {
        let bounds = Bounds { min: Point::new(0.0, 0.0), max: Point::new(14.0, 14.0) };
        let canvas = Canvas::over(&bounds, (80, 60));
        let cell =
            |x, y| canvas.locate(Point::new(x, y)).map(|(cell, _)| (cell / COLUMNS_MAX, cell % COLUMNS_MAX));
        assert_eq!(cell(0.01, 13.99), Some((0, 0)));
        assert_eq!(cell(13.99, 0.01), Some((canvas.rows - 1, COLUMNS_MAX - 1)));
        assert_eq!(cell(-0.1, 1.0), None);
        assert_eq!([0.0, 1.6, 3.1, -1.6].map(arrow), ['→', '↑', '←', '↓']);
    }

    /// A picture without what moves the cursor.
    fn lines(size: (usize, usize), name: &str) -> Vec<String> {
        let mut world = generate(Family::Maze, Split::Test, 1);
        world.name = name.to_owned();
        let simulation = Simulation::new(Arc::new(world), &Task::default(), &Disturbance::none(), 1);
        let mut view = View::default();
        view.begin(&simulation);
        view.fit(&simulation, size);
        let picture = view.picture(&simulation, &seen(Twist::new(-0.5, -1.0)), 0x1fff);
        picture.lines().map(|line| line.trim_end_matches("\x1b[K").to_owned()).collect()
    }

    #[test]
    fn it_fits_any_terminal() {
        for size in [(80, 24), (60, 24), (60, 15), (200, 80), (20, 5), (1, 1)] {
            let lines = lines(size, &"a long name ".repeat(20));
            assert!(lines.len() < size.1.max(WORDS + 2), "{size:?}: {lines:?}");
            assert!(lines.iter().all(|line| line.chars().count() < size.0.max(2)), "{size:?}: {lines:?}");
        }
        let words = lines((60, 24), "maze-1");
        assert!(words.iter().any(|line| line.ends_with("faults 0x1fff")), "all of it is there: {words:?}");
    }

    #[test]
    fn a_name_cannot_command_the_terminal() {
        let lines = lines((80, 24), "\u{1b}]0;owned\u{7}\u{1b}[2J\n");
        assert!(lines.iter().all(|line| !line.contains(char::is_control)), "{lines:?}");
        assert!(lines.iter().any(|line| line.contains("\\u{1b}]0;owned")), "{lines:?}");
    }

    #[test]
    fn wide_letters_are_clipped_as_wide() {
        assert_eq!(clipped("abc", 3), "abc");
        assert_eq!(clipped("abcd", 3), "abc");
        assert_eq!(clipped("a\u{65e5}\u{672c}", 4), "a\u{65e5}");
        assert_eq!(clipped("abc", 0), "");
    }
}
