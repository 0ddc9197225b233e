//! [`RegularParams`]: what can be asked of a near-regular texture, and its defaults.

use crate::base::params::{OrAuto, Value, choice, params};
use crate::signal::basis::Basis;
use crate::verb::params::Size;

choice! {
    /// In which directions a near-regular texture repeats.
    pub enum Tileable {
        /// Nowhere.
        None = "none",
        /// In both.
        Both = "both",
        /// Horizontally only.
        X = "x",
        /// Vertically only.
        Y = "y",
    }
}

choice! {
    /// By what the patch for a gap is chosen.
    pub enum Matching {
        /// Squared differences of colour.
        Color = "color",
        /// Normalized cross-correlation: lines count more than brightness.
        Correlation = "correlation",
    }
}

choice! {
    /// How pieces are joined.
    pub enum Seam {
        /// Where the seam shows least, anywhere in the overlap (graph cut).
        Graph = "graph",
        /// Along the path of least difference across each side (minimum-error boundary cut).
        Cut = "cut",
        /// Faded over the whole overlap, as in the paper.
        Linear = "linear",
    }
}

choice! {
    /// Whether cells that lie beside their place are put into it.
    pub enum Straighten {
        /// They are taken as they lie.
        Off = "off",
        /// Each is moved to where it is most like the others.
        On = "on",
    }
}

choice! {
    /// Where pieces may lie that the lattice puts between pixels.
    pub enum Subpixel {
        /// At the nearest pixel: every pixel is a copy.
        Off = "off",
        /// There: pixels are interpolated.
        On = "on",
    }
}

/// Which lattice is followed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Guide {
    /// The one that [`detect_lattice`] finds.
    Auto,
    /// None: pieces come from anywhere.
    None,
    /// These two displacements, in pixels of the photo: to the right, downwards.
    Vectors(Basis),
}

impl Value for Guide {
    const KIND: &'static str = "lattice";

    fn parse(text: &str) -> Option<Self> {
        match text {
            "auto" => return Some(Self::Auto),
            "none" => return Some(Self::None),
            _ => {}
        }
        let numbers =
            text.split(',').map(|n| n.trim().parse::<f64>().ok().filter(|n| n.is_finite()));
        let [ax, ay, bx, by] = numbers.collect::<Option<Vec<_>>>()?.try_into().ok()?;
        Some(Self::Vectors([[ax, ay], [bx, by]]))
    }

    fn show(&self) -> String {
        match self {
            Self::Auto => "auto".into(),
            Self::None => "none".into(),
            Self::Vectors([[ax, ay], [bx, by]]) => format!("{ax},{ay},{bx},{by}"),
        }
    }

    fn expected() -> String {
        "auto, none, or two displacements as X1,Y1,X2,Y2 in pixels".into()
    }
}

params! {
    /// Parameters of [`regular`].
    pub struct RegularParams for "regular" {
        /// Size of the texture: WIDTHxHEIGHT, or auto for the photo's own (whole periods near it if it shall repeat).
        size: Size = Size::Auto, unit "px";
        /// In which directions the texture repeats. A size given must then be a whole number of the photo's periods within 3 %.
        tileable: Tileable = Tileable::None;
        /// The lattice that is followed: auto finds it, none takes pieces from anywhere (for textures without one), X1,Y1,X2,Y2 gives two displacements in pixels, to the right and downwards.
        lattice: Guide = Guide::Auto, unit "px";
        /// From which confidence on a lattice that was found is followed.
        min_confidence: f32 = 0.5, in 0.0..=1.0;
        /// Whether cells of the photo that lie beside their place on the lattice are put into it.
        straighten: Straighten = Straighten::On;
        /// Side of the blocks that the texture is made of: larger keeps more of the photo together, smaller mixes more.
        block: OrAuto<usize> = OrAuto::Auto, unit "px";
        /// How far pieces overlap with their neighbours, to either side; at most half a block.
        border: OrAuto<usize> = OrAuto::Auto, unit "px";
        /// How many places are tried for each of the pieces that are drawn at random: of these the one that agrees best with the random pieces around it is taken. 1 leaves it to chance, as in the paper; 16 joins stones and panes of many sizes and colours better, and mixes the photo a little less evenly.
        sample_candidates: usize = 1, in 1..=65536;
        /// How many pieces are tried for every gap between those that were drawn at random.
        candidates: usize = 64, in 1..=65536;
        /// How far from its place on the lattice a piece for a gap may come from.
        tolerance: usize = 3, in 0..=64, unit "px";
        /// Whether pieces that the lattice puts between pixels are interpolated there (Lanczos), or moved to the nearest pixel and copied.
        subpixel: Subpixel = Subpixel::Off;
        /// By what a piece for a gap is chosen.
        matching: Matching = Matching::Color;
        /// How far such a piece may be bent so that lines meet that do not by themselves; 0 switches it off.
        deform: usize = 0, in 0..=8, unit "px";
        /// How pieces are joined.
        seam: Seam = Seam::Graph;
        /// How far the two sides of a seam are faded into each other; with 0 every pixel is a copy of one of the photo's. Linear seams are as wide as the border.
        feather: usize = 4, in 0..=64, unit "px";
        /// Reach of the light flattening: differences of light that are wider are taken out of the photo first, as pieces from dark and from bright parts would lie side by side. Auto takes a quarter, or more where a period is longer, unless it would change colours by more than 2.5 times; 0 switches it off.
        flatten: OrAuto<f32> = OrAuto::Auto, unit "fraction of the photo's shorter side";
    }
}
