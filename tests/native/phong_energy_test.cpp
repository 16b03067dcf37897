#include "reflectance/phong_energy.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "reflectance/albedo.h"
#include "reflectance/model.h"

namespace lobefit {
namespace {

template <typename Real>
PhongEnergy<Real> energy(bool modified, Real exponent, const ViewAngle<Real>& view) {
  return modified ? modified_phong_energy(exponent, view) : phong_energy(exponent, view);
}

// Quadratures of 30 digits: see phong_energy_reference.py. by_angle is NaN at 0 degrees.
struct Reference {
  bool modified;
  double exponent, angle;
  double value, by_exponent, by_angle;
};

constexpr Reference references[] = {
#include "phong_energy_reference.inc"
};

TEST(PhongEnergy, IsTheIntegralInDoublePrecision) {
  // Some ten roundings; asked for are 1e-13.
  for (const Reference& r : references) {
    const auto view = ViewAngle<double>::from_degrees(r.angle);
    EXPECT_NEAR(energy(r.modified, r.exponent, view).value / r.value, 1, 2e-15)
        << r.modified << " " << r.exponent << " " << r.angle;
  }
}

TEST(PhongEnergy, IsTheIntegralInSinglePrecision) {
  // Asked for are 1e-5.
  for (const Reference& r : references) {
    // Rounded from double precision: 89.9999999 degrees are 90 in single precision.
    const auto exact = ViewAngle<double>::from_degrees(r.angle);
    const ViewAngle<float> view{static_cast<float>(exact.cosine), static_cast<float>(exact.sine)};
    const auto exponent = static_cast<float>(r.exponent);
    EXPECT_NEAR(energy(r.modified, exponent, view).value / r.value, 1, 1e-6)
        << r.modified << " " << r.exponent << " " << r.angle;
  }
}

TEST(PhongEnergy, HasTheDerivativesOfTheIntegral) {
  for (const Reference& r : references) {
    const auto view = ViewAngle<double>::from_degrees(r.angle);
    const PhongEnergy<double> at = energy(r.modified, r.exponent, view);
    EXPECT_NEAR(at.by_exponent / r.by_exponent, 1, 1e-14)
        << r.modified << " " << r.exponent << " " << r.angle;
    // The central differences cannot tell a slope below 1e-30 from none; sin^n theta is off by the
    // rounding of its logarithm, which is up to 70 here.
    if (!std::isnan(r.by_angle)) {
      EXPECT_NEAR(at.by_angle, r.by_angle, 2e-14 * std::abs(r.by_angle) + 1e-30)
          << r.modified << " " << r.exponent << " " << r.angle;
    }
  }
}

TEST(PhongEnergy, IsTheSumForWholeExponents) {
  for (const int exponent : {0, 1, 2, 3, 4, 17, 18, 19, 20, 21, 300, 5001}) {
    for (const double angle : {0.0, 20.0, 45.0, 80.0, 89.5, 90.0}) {
      const auto view = ViewAngle<double>::from_degrees(angle);
      // The sum's powers of a rounded sine are off by the exponent times that rounding.
      const double bound = 1e-14 + 1e-16 * exponent;
      EXPECT_NEAR(summed_phong_energy(exponent, view) / phong_energy<double>(exponent, view).value,
                  1, bound);
      EXPECT_NEAR(summed_modified_phong_energy(exponent, view) /
                      modified_phong_energy<double>(exponent, view).value,
                  1, bound);
    }
  }
}

TEST(PhongEnergy, IsTheAlbedoOfTheModel) {
  Parameters lobe;
  lobe.kind = ModelKind::interpolated;
  lobe.specular = Rgb::Ones();
  for (const double exponent : {1.5, 12.0, 90.0}) {
    lobe.exponent = Rgb::Constant(exponent);
    for (const double angle : {0.0, 40.0, 70.0, 85.0}) {
      const auto view = ViewAngle<double>::from_degrees(angle);
      const Reflectance reflectance = [&](const Vector3& wi, const Vector3& wo) {
        return evaluate_model(lobe, wi, wo);
      };
      // That sum of 5,400 half vectors is itself within 1e-3.
      EXPECT_NEAR(directional_albedo(reflectance, radians(angle))[0] /
                      modified_phong_energy(exponent, view).value,
                  1, 2e-3)
          << exponent << " " << angle;
    }
  }
}

TEST(PhongEnergy, HasTheLimitsOfItsAngles) {
  for (const double n : {0.0, 1e-37, 0.6, 8.0, 19.9, 20.1, 1e3, 1e12}) {
    const auto facing = ViewAngle<double>::from_degrees(0),
               grazing = ViewAngle<double>::from_degrees(90);
    EXPECT_NEAR(phong_energy(n, facing).value * (n + 1) / (2 * pi), 1, 1e-14);
    EXPECT_NEAR(modified_phong_energy(n, facing).value * (n + 2) / (2 * pi), 1, 1e-14);
    EXPECT_NEAR(phong_energy(n, grazing).value * (n + 1) / pi, 1, 1e-14);
    // Half a lobe at the horizon has B((n+1)/2, 1/2) / (n+2); that quotient of gamma functions by
    // lgamma loses up to a digit for each of the exponent.
    const double beta = std::exp(std::lgamma((n + 1) / 2) - std::lgamma(n / 2 + 1)) * std::sqrt(pi);
    EXPECT_NEAR(modified_phong_energy(n, grazing).value * (n + 2) / beta, 1, 1e-14 * (10 + n));
  }
}

TEST(PhongEnergy, KeepsItsRecurrences) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> exponent(-3, 5), angle(0, 90);
  for (int i = 0; i < 20000; ++i) {
    const double n = std::pow(10, exponent(random));
    const auto view = ViewAngle<double>::from_degrees(angle(random));
    const auto [c, s] = view;
    const PhongEnergy<double> phong = phong_energy(n, view);
    // By parts, where the derivative by the angle stands for the boundary, -2 W_{n+1} sin^n. Both
    // sides share the rounding of sin theta, so some ten others are left.
    EXPECT_NEAR((n + 3) * phong_energy(n + 2, view).value /
                    ((n + 1) * phong.value - c * s * phong.by_angle),
                1, 2e-15)
        << n << " " << c;
    const double above = modified_phong_energy(n + 1, view).value;
    EXPECT_NEAR((n + 3) * above /
                    ((n + 3) * c * phong_energy(n + 2, view).value - s * s * s * phong.by_angle),
                1, 2e-15)
        << n << " " << c;
  }
}

TEST(PhongEnergy, FallsWithExponentAndAngle) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> exponent(-37, 12), angle(0, 90);
  for (int i = 0; i < 20000; ++i) {
    const double n = std::pow(10, exponent(random));
    const auto view = ViewAngle<double>::from_degrees(angle(random));
    for (const bool modified : {false, true}) {
      const PhongEnergy<double> at = energy(modified, n, view);
      EXPECT_LT(at.by_exponent, 0) << n << " " << view.cosine;
      EXPECT_LE(at.by_angle, 0) << n << " " << view.cosine;
    }
  }
}

}  // namespace
}  // namespace lobefit
