//! Clothes, hair and skin.

use chaic_core::capability::{Impairment, Persona};
use chaic_world::Posture;

/// Headwear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Headwear {
    None,
    Cap,
    Helmet,
}

/// Hair style.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Hair {
    Short,
    Long,
    Bun,
    Tail,
    /// Bald on top.
    Thin,
}

/// Pattern of the shirt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Pattern {
    Plain,
    Stripes([u8; 3]),
    /// A row of buttons and a collar.
    Buttons([u8; 3]),
}

/// Clothes and colors of a person, sRGB.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outfit {
    pub skin: [u8; 3],
    pub hair: [u8; 3],
    pub hair_cut: Hair,
    pub beard: bool,
    pub shirt: [u8; 3],
    pub pattern: Pattern,
    pub long_sleeves: bool,
    pub trousers: [u8; 3],
    pub short_trousers: bool,
    pub shoes: [u8; 3],
    pub soles: [u8; 3],
    pub belt: [u8; 3],
    /// Color of a vest over the shirt.
    pub vest: Option<[u8; 3]>,
    pub headwear: Headwear,
    pub headwear_color: [u8; 3],
    pub glasses: bool,
    /// True if the glasses are dark.
    pub dark_glasses: bool,
}

const SKINS: [[u8; 3]; 5] =
    [[236, 196, 168], [208, 160, 124], [168, 116, 82], [122, 80, 56], [224, 178, 146]];
const HAIRS: [[u8; 3]; 5] =
    [[58, 40, 28], [24, 20, 18], [120, 78, 40], [190, 150, 88], [92, 46, 26]];
const SHIRTS: [[u8; 3]; 6] =
    [[62, 98, 158], [164, 62, 58], [88, 124, 80], [196, 170, 116], [112, 88, 140], [206, 206, 200]];
const TROUSERS: [[u8; 3]; 4] = [[52, 58, 78], [92, 80, 66], [70, 72, 74], [40, 44, 48]];
const SHOES: [[u8; 3]; 4] = [[60, 44, 34], [120, 74, 44], [44, 52, 72], [76, 76, 78]];
const BRIGHTS: [[u8; 3]; 5] =
    [[244, 196, 38], [228, 70, 64], [64, 168, 96], [238, 120, 40], [230, 96, 150]];

impl Outfit {
    pub fn new(posture: &Posture) -> Outfit {
        let style = usize::from(posture.appearance);
        let pick = |colors: &[[u8; 3]], step: usize| colors[(style / step) % colors.len()];
        let plain = Outfit {
            skin: pick(&SKINS, 1),
            hair: pick(&HAIRS, 2),
            hair_cut: [Hair::Short, Hair::Long, Hair::Short, Hair::Bun, Hair::Thin, Hair::Tail]
                [style % 6],
            beard: style % 6 == 4 || style % 12 == 2,
            shirt: SHIRTS[(style + style / 6) % SHIRTS.len()],
            pattern: [
                Pattern::Plain,
                Pattern::Stripes([236, 234, 226]),
                Pattern::Buttons([240, 238, 230]),
                Pattern::Plain,
                Pattern::Stripes([40, 52, 84]),
            ][style % 5],
            long_sleeves: style % 3 != 1,
            trousers: pick(&TROUSERS, 1),
            short_trousers: false,
            shoes: SHOES[style % SHOES.len()],
            soles: [[40, 36, 34], [232, 230, 224]][style / 2 % 2],
            belt: [54, 40, 30],
            vest: None,
            headwear: Headwear::None,
            headwear_color: [30, 140, 140],
            glasses: false,
            dark_glasses: posture.impairments.has(Impairment::LowVision),
        };
        match posture.persona {
            Persona::Adult => plain,
            Persona::Helper => Outfit {
                shirt: [232, 234, 232],
                pattern: Pattern::Plain,
                beard: false,
                trousers: [50, 62, 74],
                vest: Some([16, 146, 142]),
                headwear: Headwear::Cap,
                headwear_color: [16, 146, 142],
                ..plain
            },
            Persona::Child => Outfit {
                shirt: BRIGHTS[style % BRIGHTS.len()],
                pattern: [Pattern::Stripes([250, 250, 244]), Pattern::Plain][style % 2],
                hair_cut: [Hair::Short, Hair::Tail, Hair::Long][style % 3],
                beard: false,
                long_sleeves: false,
                trousers: [66, 104, 176],
                short_trousers: true,
                shoes: [222, 60, 56],
                ..plain
            },
            Persona::Wheelchair => Outfit { trousers: [64, 70, 88], long_sleeves: true, ..plain },
            Persona::Rider => Outfit {
                shirt: [70, 128, 188],
                trousers: [44, 46, 52],
                headwear: Headwear::Helmet,
                headwear_color: [226, 70, 48],
                ..plain
            },
            Persona::Frail => Outfit {
                hair: [206, 206, 208],
                hair_cut: [Hair::Thin, Hair::Bun][style % 2],
                pattern: Pattern::Buttons([226, 214, 200]),
                shirt: [134, 92, 104],
                long_sleeves: true,
                trousers: [104, 96, 88],
                glasses: true,
                ..plain
            },
        }
    }
}
