//! Where policies drive: generated worlds, world files, or both, in a fixed order.

use anyhow::{Context, Result};
use nav_core::footprint::Footprint;
use nav_env::worlds::{Place, Scene};
use nav_host::sha256::sha256_hex;
use nav_sim::families::{Family, Split};
use nav_sim::world::World;
use nav_sim::world_file;
use serde::Serialize;
use std::path::Path;
use std::sync::Arc;

/// The families that tables usually have.
pub const USUAL: [Family; 11] = [
    Family::Clutter,
    Family::Boxes,
    Family::UTrap,
    Family::DeepU,
    Family::Hook,
    Family::Maze,
    Family::Rooms,
    Family::Crowd,
    Family::Stream,
    Family::Corridor,
    Family::Doorway,
];

/// A world that was read.
#[derive(Debug, Serialize)]
pub struct WorldFile {
    /// The file's name.
    pub file: String,
    /// Of its bytes.
    pub sha256: String,
    #[serde(skip)]
    world: Arc<World>,
}

/// Every world, in the order in which they are driven.
#[derive(Debug, Serialize)]
pub struct Scenes {
    families: Vec<Family>,
    split: Split,
    /// Worlds a family.
    worlds: u32,
    files: Vec<WorldFile>,
    #[serde(skip)]
    footprint: Footprint,
}

impl Scenes {
    /// Worlds for a robot of a radius (m): `worlds` of each family, then every file of the folder.
    ///
    /// # Errors
    /// A file that is no world for it.
    pub fn read(
        families: &[Family],
        split: Split,
        worlds: u32,
        folder: Option<&Path>,
        footprint: &Footprint,
    ) -> Result<Self> {
        let mut files = Vec::new();
        for (path, world) in
            folder.map(|folder| world_file::read_folder(folder, footprint)).transpose()?.unwrap_or_default()
        {
            let bytes = std::fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?;
            let name = path.file_name().context("a world file without a name")?;
            files.push(WorldFile {
                file: name.to_string_lossy().into_owned(),
                sha256: sha256_hex(&bytes),
                world: Arc::new(world),
            });
        }
        Ok(Self { families: families.to_vec(), split, worlds, files, footprint: *footprint })
    }

    /// How many worlds there are.
    pub fn len(&self) -> usize {
        self.generated() + self.files.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn generated(&self) -> usize {
        self.families.len() * self.worlds as usize
    }

    /// Which world an index stands for, and its seed. A world that was read is simulated with its place in the folder
    /// as seed, as `simulator --world-file FOLDER` does.
    pub fn scene(&self, index: usize) -> (Scene, u64) {
        match index.checked_sub(self.generated()) {
            None => {
                let (family, seed) = (index / self.worlds as usize, index % self.worlds as usize);
                (Scene::Family(self.families[family], self.split), seed as u64)
            }
            Some(number) => (Scene::File(self.files[number].file.as_str().into()), number as u64),
        }
    }

    /// The world of an index, with its shortest ways.
    pub fn place(&self, index: usize) -> Place {
        match self.scene(index) {
            (Scene::Family(family, split), seed) => Place::generated(family, split, seed, &self.footprint),
            (Scene::File(name), number) => {
                let world = self.files[number as usize].world.clone();
                Place::read(&name, world, number, &self.footprint)
            }
        }
    }

    /// The indices of the first `count` worlds of each family, and of the files.
    pub fn first(&self, count: usize) -> Vec<usize> {
        let starts =
            (0..self.families.len()).map(|family| (family * self.worlds as usize, self.worlds as usize));
        let files = (self.generated(), self.files.len());
        starts.chain([files]).flat_map(|(start, length)| start..start + length.min(count)).collect()
    }
}
