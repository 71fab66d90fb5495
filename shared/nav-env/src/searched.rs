//! What a planner's searches take: the planner counts, rows keep it.

/// What the searches of an episode took, of a driver that plans on a grid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Searched {
    /// Searches; of a planner that knows the map, one.
    pub searches: u32,
    /// Nodes expanded (their neighbours looked at), in all of them.
    pub expanded: u64,
    /// Nodes that there are, free or not: what a search can expand at the most.
    pub cells: u64,
    /// Memory of the map that is searched and of the search, at the most, bytes: what their data take, without what an
    /// allocator keeps spare.
    pub bytes: u64,
}

impl Searched {
    /// With another search of the same episode.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            searches: self.searches + other.searches,
            expanded: self.expanded + other.expanded,
            cells: self.cells.max(other.cells),
            bytes: self.bytes.max(other.bytes),
        }
    }
}
