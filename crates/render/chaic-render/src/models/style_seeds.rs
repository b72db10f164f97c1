//! Random seeds of styles and tints.

use chaic_core::ClassId;

/// Classes in the order of the first catalogue, whose index is their seed. Later classes get a seed
/// from their name, so that the order of the catalogue does not affect any seed.
const FIRST_CATALOGUE: [&str; 104] = [
    "apple",
    "banana",
    "orange",
    "shop_banana",
    "grape",
    "bread",
    "burger",
    "loaf_bread",
    "croissant",
    "pink_donut",
    "pepsi_can",
    "cocacola_can",
    "sprite_can",
    "fanta_can",
    "iphone",
    "ipod",
    "purse",
    "key",
    "mouse",
    "pen",
    "pencil_bucket",
    "calculator",
    "lighter",
    "vase",
    "bowl",
    "plate",
    "tea_tray",
    "plastic_basket",
    "wicker_basket",
    "wood_basket",
    "bamboo_basket",
    "backpack",
    "kettle",
    "navy_chair",
    "wood_shelving",
    "printer",
    "table",
    "television",
    "microwave",
    "dishwasher",
    "drawer",
    "piano",
    "sofa",
    "truck",
    "fire_hydrant",
    "bike",
    "tent",
    "house_front",
    "tree",
    "street_lamp",
    "bench",
    "mailbox",
    "fence",
    "bed",
    "nightstand",
    "wardrobe",
    "cabinet",
    "refrigerator",
    "kitchen_counter",
    "stove",
    "side_chair",
    "dining_table",
    "coffee_table",
    "desk",
    "stool",
    "armchair",
    "long_sofa",
    "tv_stand",
    "bookshelf",
    "potted_plant",
    "floor_lamp",
    "rug",
    "trashbin",
    "bright_fire_extinguisher",
    "person",
    "corner_sofa",
    "bench_sofa",
    "round_table",
    "stacked_tables",
    "table_lamp",
    "painting",
    "cushion",
    "suitcase",
    "trunk",
    "woven_box",
    "dog_house",
    "planter",
    "flower_vase",
    "coffee_maker",
    "toaster",
    "jug",
    "pan",
    "baking_sheet",
    "wineglass",
    "pepper_mill",
    "cutlery",
    "kitchen_tool",
    "notepad",
    "laptop",
    "headphones",
    "globe",
    "sculpture",
    "toy_horse",
    "puzzle_box",
];

/// Seed of a class, independent of the order of the catalogue.
pub(super) fn style_seed(class: ClassId) -> u32 {
    let name = class.name();
    let index = FIRST_CATALOGUE.iter().position(|first| *first == name);
    index.map_or_else(|| seed_of_name(name), |index| index as u32)
}

/// FNV-1a hash of a name, above the seeds of the first classes.
fn seed_of_name(name: &str) -> u32 {
    let hash = |h: u32, byte: u8| (h ^ u32::from(byte)).wrapping_mul(0x0100_0193);
    name.bytes().fold(0x811c_9dc5, hash) | 1 << 16
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn each_class_has_its_own_seed_that_depends_on_its_name() {
        let seeds: BTreeSet<u32> = ClassId::all().map(style_seed).collect();
        assert_eq!(seeds.len(), ClassId::all().count());
        assert_eq!(
            style_seed(ClassId::named("apple")),
            FIRST_CATALOGUE.iter().position(|n| *n == "apple").unwrap() as u32
        );
        assert!(seed_of_name("teapot") > FIRST_CATALOGUE.len() as u32);
        assert_ne!(seed_of_name("teapot"), seed_of_name("topeat"));
    }
}
