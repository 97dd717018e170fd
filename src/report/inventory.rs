//! What a scene is made of, as text for a person at a terminal: a table of its materials, and what was found in its
//! meshes.

use crate::scene::inventory::{Inventory, MaterialUse, MeshCheck, what_it_is};
use crate::text::number::{count, short};

/// Longest name in the table, characters.
const LONGEST: usize = 40;

/// Materials by area, at most `most` of them; then a line for each mesh file.
pub fn inventory(inventory: &Inventory, most: usize) -> String {
    let mut lines = Vec::new();
    if !inventory.materials.is_empty() {
        let head = ["material", "area, m²", "triangles", "what it is", "from", "remarks"].map(String::from);
        let rows: Vec<_> = std::iter::once(head).chain(inventory.materials.iter().take(most).map(row)).collect();
        lines.push(String::new());
        lines.extend(columns(&rows, [false, true, true, false, false, false]));
        if let Some(rest) = inventory.materials.get(most..).filter(|rest| !rest.is_empty()) {
            let area: f64 = rest.iter().map(|material| material.area).sum();
            lines.push(format!("and {} more with {} m² in all: --materials lists them", rest.len(), short(area)));
        }
    }
    if !inventory.meshes.is_empty() {
        lines.push(String::new());
        lines.extend(inventory.meshes.iter().map(mesh));
    }
    lines.into_iter().map(|line| line + "\n").collect()
}

fn row(material: &MaterialUse) -> [String; 6] {
    let mut what = what_it_is(&material.material);
    if let Some(flux) = material.flux {
        what += &format!(", shines {} lm", short(flux));
    }
    [
        shortened(&material.material.name),
        short(material.area),
        count(material.triangles as u64),
        what,
        material.origin.source.name().to_owned(),
        material.origin.notes.join("; "),
    ]
}

fn shortened(name: &str) -> String {
    if name.chars().count() <= LONGEST {
        return name.to_owned();
    }
    name.chars().take(LONGEST - 1).chain(['…']).collect()
}

/// Rows with two blanks between columns; `right` tells which columns end flush.
fn columns<const N: usize>(rows: &[[String; N]], right: [bool; N]) -> Vec<String> {
    let widths: [usize; N] =
        std::array::from_fn(|column| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0));
    let cell = |text: &String, column: usize| match right[column] {
        true => format!("{text:>0$}", widths[column]),
        false => format!("{text:<0$}", widths[column]),
    };
    let line = |row: &[String; N]| {
        let cells: Vec<String> = row.iter().enumerate().map(|(column, text)| cell(text, column)).collect();
        cells.join("  ").trim_end().to_owned()
    };
    rows.iter().map(line).collect()
}

/// A mesh file's line: its size, and what was found in it, where there is anything to find.
fn mesh(check: &MeshCheck) -> String {
    let part = &check.part;
    let size = part.size().to_array().map(short).join(" × ");
    let some = |number: usize, one: &str, more: &str| match number {
        0 => None,
        1 => Some(format!("1 {one}")),
        _ => Some(format!("{} {more}", count(number as u64))),
    };
    let found = [
        some(check.open_edges, "open edge", "open edges"),
        some(check.shared_edges, "edge of three or more triangles", "edges of three or more triangles"),
        some(check.bodies, "closed body", "closed bodies"),
        some(check.inwards, "of them looks inwards", "of them look inwards"),
        some(part.backs, "back of another triangle", "backs of other triangles"),
        some(part.repeated, "repeated triangle left out", "repeated triangles left out"),
        some(part.flat, "triangle without area left out", "triangles without area left out"),
        some(check.slivers, "sliver", "slivers"),
        check.unit.as_ref().map(|_| "is its unit right?".to_owned()),
    ];
    let found: String = found.into_iter().flatten().map(|found| format!(", {found}")).collect();
    let file = part.file.display();
    let triangles = some(part.triangles.len(), "triangle", "triangles").unwrap_or_else(|| "no triangle".to_owned());
    format!("mesh {file}: {size} m, {triangles}{found}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Material;
    use crate::scene::inventory::{MaterialSource, Origin};

    #[test]
    fn columns_are_aligned_and_long_lists_are_cut() {
        let of = |number: usize| MaterialUse {
            material: Material { reflectance: [0.5; 3], ..Material::black(format!("wall {number}")) },
            origin: Origin { source: MaterialSource::Mtl, notes: vec!["why".to_owned()] },
            area: 100.0 - number as f64,
            triangles: 2,
            flux: (number == 0).then_some(1235.0),
        };
        let all = Inventory { materials: (0..12).map(of).collect(), meshes: Vec::new() };
        let text = inventory(&all, 10);
        let lines: Vec<&str> = text.lines().skip(1).collect();
        assert_eq!(lines[0], "material  area, m²  triangles  what it is             from  remarks");
        assert_eq!(lines[1], "wall 0         100          2  ρ 0.5, shines 1235 lm  MTL   why");
        assert_eq!(lines[10], "wall 9          91          2  ρ 0.5                  MTL   why");
        assert_eq!(lines[11], "and 2 more with 179 m² in all: --materials lists them");
        assert_eq!(inventory(&all, 100).lines().count(), 14);
    }
}
