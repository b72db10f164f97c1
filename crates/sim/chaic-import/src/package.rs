//! The public `tdw` Python package: furniture layouts and bounding boxes of models.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use chaic_core::Vec3;
use chaic_world::Setup;
use serde::Deserialize;

use crate::axes::Triple;
use crate::{ImportError, files};

/// Versions whose layouts and boxes were compared with the tables.
const SERIES: &str = "1.12.27.";
const EXPECTED: &str = "1.12.27.x";
const GET: &str = "pip download tdw==1.12.27.0 --no-deps";

/// Furniture by floor plan and layout.
type Layouts = BTreeMap<String, BTreeMap<String, Vec<Piece>>>;

/// A piece of furniture in the package's layout.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct Piece {
    pub name: String,
    pub position: Triple,
    pub rotation: Triple,
    pub scale_factor: Triple,
    pub gravity: bool,
    pub kinematic: bool,
}

/// The package's record of a model.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Record<'a> {
    /// Category, for example `bed`.
    pub category: &'a str,
    /// Minimum and maximum corner in the model's frame, meters.
    pub bounds: [Vec3; 2],
}

#[derive(Debug, Deserialize)]
struct RawLibrary {
    records: BTreeMap<String, RawRecord>,
}

#[derive(Debug, Deserialize)]
struct RawRecord {
    wcategory: String,
    bounds: BTreeMap<String, Triple>,
}

/// Parts of the package that the import needs.
#[derive(Debug)]
pub(crate) struct Package {
    layouts: Layouts,
    layouts_path: PathBuf,
    records: BTreeMap<String, RawRecord>,
}

impl Package {
    /// Reads the package from its folder, or from the folder that contains it.
    pub fn read(folder: &Path) -> Result<Package, ImportError> {
        let is_package = |p: &Path| p.join("version.py").is_file();
        let candidates = [folder.to_owned(), folder.join("tdw")];
        let root = candidates.into_iter().find(|p| is_package(p)).ok_or_else(|| {
            let problem = format!("contains no tdw package (no version.py); get it by `{GET}`");
            ImportError::unreadable(folder, problem)
        })?;
        check_version(&root.join("version.py"))?;
        let layouts_path = root.join("add_ons/floorplan_layouts.json");
        let layouts = files::read(&layouts_path)?;
        let mut records = BTreeMap::new();
        // The free library comes last, so that its records take precedence.
        for name in ["models_full.json", "models_core.json"] {
            let library: RawLibrary = files::read(&root.join("metadata_libraries").join(name))?;
            records.extend(library.records);
        }
        Ok(Package { layouts, layouts_path, records })
    }

    /// Returns the furniture of a house.
    pub fn layout(&self, floorplan: &str, layout: &str) -> Result<&[Piece], ImportError> {
        let field = |problem| {
            ImportError::field(&self.layouts_path, format!("{floorplan}.{layout}"), problem)
        };
        let found = self.layouts.get(floorplan).and_then(|l| l.get(layout)).ok_or_else(|| {
            field(format!("is missing: there is no layout {layout} of floor plan {floorplan}"))
        })?;
        if found.len() > Setup::MAX_OBJECTS {
            return Err(field(format!("has more than {} pieces", Setup::MAX_OBJECTS)));
        }
        Ok(found)
    }

    /// Returns the path of the file with the layouts.
    pub fn layouts_path(&self) -> &Path {
        &self.layouts_path
    }

    /// Returns the record of a model.
    pub fn record(&self, model: &str) -> Option<Record<'_>> {
        let raw = self.records.get(model)?;
        let side = |name: &str| raw.bounds.get(name).copied().map(Vec3::from);
        let (left, right) = (side("left")?, side("right")?);
        let (bottom, top) = (side("bottom")?, side("top")?);
        let (back, front) = (side("back")?, side("front")?);
        let a = Vec3::new(left.x, bottom.y, back.z);
        let b = Vec3::new(right.x, top.y, front.z);
        // Some records swap the names of their sides.
        Some(Record { category: &raw.wcategory, bounds: [a.min(b), a.max(b)] })
    }
}

fn check_version(path: &Path) -> Result<(), ImportError> {
    let text = files::read_text(path)?;
    let found = text.split(['"', '\'']).nth(1).unwrap_or("without a version").to_owned();
    if found.starts_with(SERIES) {
        return Ok(());
    }
    let found = found.chars().take(40).collect();
    Err(ImportError::WrongVersion { path: path.to_owned(), found, expected: EXPECTED, get: GET })
}
