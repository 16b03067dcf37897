"""What is said of directional albedos; without NumPy, as a panel asks for it while it is drawn."""

from collections.abc import Sequence

Albedo = Sequence[float | None]  # of three channels


def excess(
    view_angle: Sequence[float], measured: Sequence[Albedo], shown: Sequence[Albedo] = ()
) -> str:
    """Says where more light is reflected than arrives, as some measurements do; empty if nowhere.

    The albedos are three channels, None where they are not known, for each view angle in degrees;
    `shown` is empty where it is not known what Cycles shows.
    """
    most, angle = _largest(view_angle, measured)
    if most <= 1:
        return ""
    told = f"The measurement reflects {most:.1%} of the light seen at {angle:.0f} degrees"
    if not shown:
        return f"{told}."
    most, _ = _largest(view_angle, shown)
    # What is capped is so but for the last digits.
    return f"{told}, the material at most {min(most, 1.0) if most < 1.001 else most:.1%}."


def _largest(view_angle: Sequence[float], albedos: Sequence[Albedo]) -> tuple[float, float]:
    """The largest channel of all, and at which view angle it is."""
    known = [
        (value, angle)
        for angle, rgb in zip(view_angle, albedos, strict=True)
        for value in rgb
        if value is not None
    ]
    return max(known, default=(0.0, 0.0))
