#include "fitting/error_figures.h"

#include <gtest/gtest.h>

#include <cmath>

#include "reflectance/abc.h"
#include "tables.h"

namespace lobefit {
namespace {

void expect_near(const ErrorFigure& figure, double error, double mass) {
  // 3 x 10^6 terms in another order, and powers to 3e-16.
  EXPECT_NEAR(figure.pooled, error / mass, 1e-11 * figure.pooled);
}

TEST(ErrorFigures, AreThoseOfAPlainLoop) {
  const Parameters lobe = lobe_of(50, 0.3, 1.5);
  const Measurement nickel = sample_measurement("nickel");
  const Measurement checkerboard = table_of([&](int h, int d, int p) -> Rgb {
    return (h + d + p) % 2 || !nickel.valid(h, d, p) ? Rgb::Constant(-1) : nickel.bin(h, d, p);
  });
  for (const Measurement* measurement : {&nickel, &checkerboard}) {
    double bins = 0, error = 0, mass = 0, error_80 = 0, mass_80 = 0, error_cosine = 0,
           mass_cosine = 0;
    for (int h = 0; h < 90; ++h) {
      for (int d = 0; d < 90; ++d) {
        for (int p = 0; p < 180; ++p) {
          if (!measurement->valid(h, d, p)) continue;
          const HalfDifference at = Measurement::centre(h, d, p);
          const auto [wi, wo] = to_directions(at);
          const Rgb m = measurement->bin(h, d, p);
          const double off = (evaluate_model(lobe, at) - m).abs().sum();
          const double edges[] = {square(h / 90.0) * pi / 2, square((h + 1) / 90.0) * pi / 2};
          const double w = std::sin(at.theta_h) * (edges[1] - edges[0]) * std::sin(at.theta_d) *
                           std::cos(at.theta_d) * wi.z() * wo.z();
          bins += 3;
          error += off;
          mass += m.sum();
          error_cosine += w * off;
          mass_cosine += w * m.sum();
          if (std::min(wi.z(), wo.z()) > std::cos(radians(80))) {
            error_80 += off;
            mass_80 += m.sum();
          }
        }
      }
    }
    const ErrorFigures figures = error_figures(*measurement, lobe, 0);
    expect_near(figures.l1, error, bins);
    expect_near(figures.relative_l1, error, mass);
    expect_near(figures.relative_l1_80, error_80, mass_80);
    expect_near(figures.relative_l1_cosine, error_cosine, mass_cosine);
  }
}

}  // namespace
}  // namespace lobefit
