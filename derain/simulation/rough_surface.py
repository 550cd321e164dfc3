"""The light that a rough surface returns to its source."""

from derain.simulation.arrays import Floats


def backscatter(cosine: Floats, roughness: Floats) -> Floats:
    """Apparent reflectivity of surfaces over their reflectivity, float64 (N,).

    A smooth matt surface returns as Lambert's: in proportion to the cosine of the angle of
    incidence, so that a road that is lit at a grazing angle is nearly black. The facets of a rough
    one partly face the light, and it returns a share B of what it does not lose, however flat the
    light comes in.

    It is Oren and Nayar's qualitative model where light and eye are at one place:
    A cos θ + B sin² θ, with A = 1 - 0.5 σ² / (σ² + 0.33) and B = 0.45 σ² / (σ² + 0.09).

    Args:
        cosine: Cosine of the angle of incidence θ, float64 (N,), in 0..1.
        roughness: Standard deviation σ of the slopes of the facets, float64 (N,), radians; 0 is
            Lambert's surface.

    Source: Oren and Nayar 1994, "Generalization of Lambert's reflectance model". That it corrects
        intensities of laser scanners: "Terrestrial Laser Scanning Intensity Correction by Piecewise
        Fitting and Overlap-Driven Adjustment", Remote Sensing 9(11), 1090, 2017.
    """
    variance = roughness**2
    facing = 1 - 0.5 * variance / (variance + 0.33)
    grazing = 0.45 * variance / (variance + 0.09)
    return facing * cosine + grazing * (1 - cosine**2)
