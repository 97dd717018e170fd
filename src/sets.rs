//! Things that are joined to sets, pair by pair (union-find with halved paths, Tarjan & van Leeuwen 1984).

/// Sets of the numbers from 0 on; each is known by one of its members, its root.
pub(crate) struct Sets {
    parent: Vec<u32>,
}

impl Sets {
    /// Every number by itself.
    pub(crate) fn new(count: usize) -> Self {
        Self { parent: (0..count as u32).collect() }
    }

    /// How many numbers there are.
    pub(crate) fn len(&self) -> usize {
        self.parent.len()
    }

    /// The root of a number's set. Cost: next to nothing, as ways to roots get shorter.
    pub(crate) fn root(&mut self, mut member: u32) -> u32 {
        while self.parent[member as usize] != member {
            let above = self.parent[self.parent[member as usize] as usize];
            self.parent[member as usize] = above;
            member = above;
        }
        member
    }

    /// Makes one set of two; the lower root is its root.
    pub(crate) fn join(&mut self, one: u32, other: u32) {
        let (one, other) = (self.root(one), self.root(other));
        self.hang(one.max(other), one.min(other));
    }

    /// Makes one set of two whose roots are known; `root` is its root.
    pub(crate) fn hang(&mut self, child: u32, root: u32) {
        self.parent[child as usize] = root;
    }
}
