"""Error and run time of cheaper alterations of Phong's specular term: ./dev bench phong_alterations

A line for each exponent, term and gamma (lobefit/alterations.py, native/preview/phong_terms.h): the
worst and the mean difference to the exact term over the pixels of a sphere, the worst for normals
that are 1 % too short, and nanoseconds an evaluation, one by one and in lanes, beside how much
faster than the exact term that is. Marked (*) are those whose error an 8-bit picture does not show.
"""

from lobefit.alterations import STEP, TITLES, measure


def main() -> None:
    print(
        "| exponent | term | gamma | worst | mean | short normals | ns | times | lanes ns | times |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|")
    for each in measure():
        if each.term == "exact":
            exact = each
        mark = " *" if each.worst < STEP and each.term != "exact" else ""
        print(
            f"| {each.exponent:g} | {TITLES[each.term]} | {each.gamma or ''} | "
            f"{each.worst:.4f}{mark} | {each.mean:.5f} | {each.short:.4f} | "
            f"{each.one_by_one:.2f} | {exact.one_by_one / each.one_by_one:.1f} | "
            f"{each.in_lanes:.2f} | {exact.in_lanes / each.in_lanes:.1f} |"
        )


if __name__ == "__main__":
    main()
