//! Sines and cosines of several angles at a time, up to 10⁶ rad the same to the last bit on every machine.
//!
//! The quadrant is subtracted in pieces of π/2 that are exact in products with small integers (Cody & Waite 1980), and
//! what is left goes into the polynomials of Sun's fdlibm (`k_sin.c`, `k_cos.c`), whose own error is below 2⁻⁵⁸; with rounding
//! a result is within 2⁻⁵² of the standard library's, whose functions take one angle after the other, and whose last bit
//! depends on the system.

use multiversion::multiversion;

use crate::model::wide::{LANES, Lanes};

/// Beyond this magnitude, rad, multiples of π/2 are too large for the exact products.
const FARTHEST: f64 = 1e6;

/// π/2 = the sum of these: 33 bits each, and the rest.
const PARTS: [f64; 3] = [1.570_796_326_734_125_6, 6.077_100_506_303_966e-11, 2.022_266_248_795_950_6e-21];

/// Added to and taken from a number it rounds that to an integer, which stands in its lowest bits in between.
const ROUNDING: f64 = 6_755_399_441_055_744.0;

/// Coefficients of x³, x⁵, … of the sine.
const SINE: [f64; 6] = [
    -1.666_666_666_666_663_2e-1,
    8.333_333_333_322_49e-3,
    -1.984_126_982_985_795e-4,
    2.755_731_370_707_006_8e-6,
    -2.505_076_025_340_686_3e-8,
    1.589_690_995_211_55e-10,
];

/// Coefficients of x⁴, x⁶, … of the cosine.
const COSINE: [f64; 6] = [
    4.166_666_666_666_66e-2,
    -1.388_888_888_887_411e-3,
    2.480_158_728_947_673e-5,
    -2.755_731_435_139_066_3e-7,
    2.087_572_321_298_175e-9,
    -1.135_964_755_778_819_5e-11,
];

/// The sines and the cosines of `angles` (rad); of one that is not finite NaN.
#[inline(always)] // compiled for the processor of the caller's kernel
pub fn sines_and_cosines(angles: &Lanes) -> [Lanes; 2] {
    let (mut sines, mut cosines) = ([0.0; LANES], [0.0; LANES]);
    of_near(angles, &mut sines, &mut cosines);
    for lane in 0..LANES {
        if angles[lane].abs() > FARTHEST {
            (sines[lane], cosines[lane]) = angles[lane].sin_cos();
        }
    }
    [sines, cosines]
}

/// Sines and cosines of angles no farther than [`FARTHEST`].
#[multiversion(targets("x86_64+avx2"))]
fn of_near(angles: &Lanes, sines: &mut Lanes, cosines: &mut Lanes) {
    for lane in 0..LANES {
        [sines[lane], cosines[lane]] = near(angles[lane]);
    }
}

/// Sine and cosine of an angle no farther than [`FARTHEST`]. Without branches, so that it is computed in lanes.
#[inline(always)] // the body of a loop over lanes
fn near(angle: f64) -> [f64; 2] {
    let shifted = angle * std::f64::consts::FRAC_2_PI + ROUNDING;
    let quadrant = shifted.to_bits();
    let count = shifted - ROUNDING;
    let x = PARTS.iter().fold(angle, |left, part| left - count * part);
    let square = x * x;
    let polynomial =
        |coefficients: &[f64; 6]| coefficients.iter().rev().fold(0.0, |sum, each| sum * square + each);
    let sine = x + x * square * polynomial(&SINE);
    let cosine = (1.0 - 0.5 * square) + square * square * polynomial(&COSINE);
    let odd = quadrant & 1 == 1;
    let [sine, cosine] = if odd { [cosine, sine] } else { [sine, cosine] };
    let signed = |value: f64, turned: u64| f64::from_bits(value.to_bits() ^ ((turned & 2) << 62));
    [signed(sine, quadrant), signed(cosine, quadrant.wrapping_add(1))]
}
