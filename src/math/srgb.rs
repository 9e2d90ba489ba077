//! The transfer function of sRGB (IEC 61966-2-1).

/// Linear value to 8 bits: clipped to `[0, 1]`, encoded, rounded to nearest.
pub fn encode(linear: f32) -> u8 {
    let x = f64::from(linear).clamp(0.0, 1.0);
    let encoded = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
    (encoded * 255.0).round() as u8
}

/// Encoded value, 1 for the largest code, to linear.
pub fn decode(encoded: f32) -> f32 {
    let x = f64::from(encoded);
    let linear = if x <= 0.040_45 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) };
    linear as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_codes() {
        // 255 * (1.055 * 0.5^(1/2.4) - 0.055) = 187.52; 255 * 12.92 * 0.001 = 3.29;
        // 255 * (1.055 * 0.18^(1/2.4) - 0.055) = 117.65.
        for (linear, code) in [(0.0, 0), (0.001, 3), (0.18, 118), (0.5, 188), (1.0, 255), (-1.0, 0), (7.0, 255)] {
            assert_eq!(encode(linear), code, "{linear}");
        }
    }

    #[test]
    fn every_code_survives() {
        for code in 0..=255u8 {
            assert_eq!(encode(decode(f32::from(code) / 255.0)), code);
        }
    }
}
