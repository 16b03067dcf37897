#include "measurement/half_difference.h"

#include <gtest/gtest.h>

#include <cmath>

namespace lobefit {
namespace {

TEST(HalfDifference, GivesBackTheAnglesItWasMadeFrom) {
  for (double theta_h = 0.001; theta_h < 1.2; theta_h += 0.13) {
    for (double theta_d = 0.001; theta_d < 1.5; theta_d += 0.17) {
      for (double phi_d = 0.01; phi_d < pi; phi_d += 0.31) {
        const Directions directions = to_directions({theta_h, theta_d, phi_d});
        const HalfDifference found = to_half_difference(directions.wi, directions.wo);
        EXPECT_NEAR(found.theta_h, theta_h, 1e-13);
        EXPECT_NEAR(found.theta_d, theta_d, 1e-13);
        // An azimuth about an axis of length sin(theta) is known to rounding over that length.
        EXPECT_NEAR(found.phi_d, phi_d, 1e-15 / (std::sin(theta_h) * std::sin(theta_d)) + 1e-13);
      }
    }
  }
}

TEST(HalfDifference, IsTheSameForExchangedDirections) {
  const Directions directions = to_directions({0.4, 0.7, 1.1});
  const HalfDifference exchanged = to_half_difference(directions.wo, directions.wi);
  EXPECT_NEAR(exchanged.theta_h, 0.4, 1e-14);
  EXPECT_NEAR(exchanged.theta_d, 0.7, 1e-14);
  EXPECT_NEAR(exchanged.phi_d, 1.1, 1e-14);
}

TEST(HalfDifference, DoesNotDependOnATurnAboutTheNormal) {
  const Directions at = to_directions({0.4, 0.7, 1.1});
  const double c = std::cos(0.9), s = std::sin(0.9);
  const auto turned = [&](const Vector3& v) {
    return Vector3(c * v.x() - s * v.y(), s * v.x() + c * v.y(), v.z());
  };
  const HalfDifference found = to_half_difference(turned(at.wi), turned(at.wo));
  EXPECT_NEAR(found.theta_h, 0.4, 1e-14);
  EXPECT_NEAR(found.phi_d, 1.1, 1e-14);
}

TEST(HalfDifference, IsDefinedAtTheMirrorDirectionAndAlongTheNormal) {
  const Vector3 up(0, 0, 1);
  const HalfDifference at = to_half_difference(up, up);
  EXPECT_EQ(at.theta_h, 0);
  EXPECT_EQ(at.theta_d, 0);
  EXPECT_TRUE(std::isfinite(at.phi_d));
}

}  // namespace
}  // namespace lobefit
