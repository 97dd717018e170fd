//! What a slider dims: a luminaire, or all of a group where the page would be too large otherwise.

use serde::Serialize;

use super::LiveLamp;

/// One or more luminaires that are dimmed alike.
#[derive(Serialize)]
pub(super) struct Unit<'a> {
    name: &'a str,
    group: &'a str,
    /// Names of its luminaires, by which dimming is saved.
    names: Vec<&'a str>,
    outlines: Vec<&'a [[f64; 2]]>,
    level: f64,
    least: f64,
    power: Vec<[f64; 2]>,
    off: f64,
    /// Numbers of its luminaires.
    #[serde(skip)]
    pub(super) members: Vec<usize>,
}

/// Each luminaire by itself.
pub(super) fn single(lamps: &[LiveLamp]) -> Vec<Unit<'_>> {
    lamps.iter().enumerate().map(|(index, lamp)| Unit::of(&lamp.name, lamps, vec![index])).collect()
}

/// The groups, in the order in which they are first named.
pub(super) fn groups(lamps: &[LiveLamp]) -> Vec<Unit<'_>> {
    let mut names: Vec<&str> = Vec::new();
    let mut members: std::collections::HashMap<&str, Vec<usize>> = std::collections::HashMap::new();
    for (index, lamp) in lamps.iter().enumerate() {
        let of_group = members.entry(&lamp.group).or_default();
        if of_group.is_empty() {
            names.push(&lamp.group);
        }
        of_group.push(index);
    }
    let unit = |name| Unit::of(name, lamps, members.remove(name).unwrap_or_default());
    names.into_iter().map(unit).collect()
}

/// Sums of a value of each luminaire over each unit.
pub(super) fn sums<'a>(units: &'a [Unit<'_>], values: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
    units.iter().map(|unit| unit.members.iter().map(|&lamp| values[lamp]).sum())
}

impl<'a> Unit<'a> {
    fn of(name: &'a str, lamps: &'a [LiveLamp], members: Vec<usize>) -> Self {
        let all = || members.iter().map(|&index| &lamps[index]);
        let least = all().map(|lamp| lamp.least).fold(0.0, f64::max);
        let mut levels: Vec<f64> = all().flat_map(|lamp| lamp.power.iter().map(|&[level, _]| level)).collect();
        levels.extend([least, 1.0]);
        levels.retain(|level| (least..=1.0).contains(level));
        levels.sort_by(f64::total_cmp);
        levels.dedup();
        Self {
            name,
            group: &lamps[members[0]].group,
            names: all().map(|lamp| lamp.name.as_str()).collect(),
            outlines: all().map(|lamp| lamp.outline.as_slice()).collect(),
            level: all().map(|lamp| lamp.level).sum::<f64>() / members.len() as f64,
            least,
            power: levels.iter().map(|&level| [level, all().map(|lamp| power(lamp, level)).sum()]).collect(),
            off: all().map(|lamp| lamp.off).sum(),
            members,
        }
    }
}

/// Power of a luminaire that is on, W.
fn power(lamp: &LiveLamp, level: f64) -> f64 {
    let after = lamp.power.partition_point(|&[known, _]| known < level);
    match (after.checked_sub(1).map(|before| lamp.power[before]), lamp.power.get(after)) {
        (Some([a, low]), Some(&[b, high])) => low + (high - low) * (level - a) / (b - a),
        (Some([_, watts]), None) | (None, Some(&[_, watts])) => watts,
        (None, None) => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two lamps at one level draw what both draw at that level, with a bend where either has one.
    #[test]
    fn a_group_draws_the_sum_of_its_luminaires() {
        let lamp = |name: &str, least, power: &[[f64; 2]]| LiveLamp {
            name: name.into(),
            group: "row".into(),
            outline: vec![[0.0, 0.0]],
            level: 0.5,
            least,
            power: power.to_vec(),
            off: 0.5,
        };
        let lamps =
            [lamp("a", 0.1, &[[0.1, 5.0], [0.6, 10.0], [1.0, 30.0]]), lamp("b", 0.2, &[[0.2, 8.0], [1.0, 40.0]])];
        let [unit] = &groups(&lamps)[..] else { panic!("one group") };
        assert_eq!((unit.least, unit.level, unit.off), (0.2, 0.5, 1.0));
        // 5 + 0.1 · 5/0.5 + 8, 10 + 8 + 0.4 · 32/0.8, 30 + 40
        let expected = [[0.2, 14.0], [0.6, 34.0], [1.0, 70.0]];
        assert_eq!(unit.power.len(), 3);
        for (found, expected) in unit.power.iter().zip(expected) {
            assert!(found[0] == expected[0] && (found[1] - expected[1]).abs() < 1e-12, "{found:?}, not {expected:?}");
        }
    }
}
