// The normalisation of Phong's lobes in constant time against its rivals: ./dev bench phong_energy
//
// Nanoseconds an evaluation of both integrals, for exponents of 1 to 1e6 and 64 view angles, the
// least of nine rounds, all in one run: the O(1) algorithm of phong_energy.h in double, with
// derivatives, and in single precision; the O(n) sum for whole exponents; and Mallett and Yuksel's
// formula as published, with a quotient of gamma functions by lgamma and Boost's incomplete beta
// function, with and without promotion to long double. Beside them stand the largest relative
// errors against the O(1) algorithm. The last line tells from which exponent on it beats the sum.
#include "reflectance/phong_energy.h"

#include <algorithm>
#include <boost/math/special_functions/beta.hpp>
#include <chrono>
#include <cstdio>
#include <vector>

namespace lobefit {
namespace {

struct Values {
  double phong;
  double modified;
};

// The paper's equations 7 and 8, up to notation: incomplete beta functions of sin^2 theta.
template <typename Real, typename Policy>
Values as_published(Real n, const ViewAngle<Real>& view, const Policy& policy) {
  const Real half = n / 2, c = view.cosine, s2 = 1 - c * c, half_turn = static_cast<Real>(pi);
  const auto quotient = [](Real a, Real b) { return std::exp(std::lgamma(a) - std::lgamma(b)); };
  const auto incomplete = [&](Real a) {
    return s2 > 0 ? boost::math::beta(a, Real(0.5), s2, policy) : 0;
  };
  const Real root_pi = std::sqrt(half_turn);
  const Real phong = (2 * half_turn - root_pi * quotient(half + 1, half + Real(0.5)) *
                                          incomplete(half + Real(0.5))) /
                     (n + 1);
  const Real modified =
      (2 * half_turn * c + root_pi * quotient(half + Real(0.5), half + 1) *
                               (std::pow(s2, half) - c * half * incomplete(half))) /
      (n + 2);
  return {phong, modified};
}

template <typename Real>
std::vector<ViewAngle<Real>> views() {
  std::vector<ViewAngle<Real>> result;
  for (int i = 0; i < 64; ++i) {
    const auto view = ViewAngle<double>::from_degrees((i + 0.5) * 90 / 64);
    result.push_back({static_cast<Real>(view.cosine), static_cast<Real>(view.sine)});
  }
  return result;
}

double keep(double value) {
  static volatile double sink;
  sink = value;
  return sink;
}

// Nanoseconds of both integrals at one view angle.
template <typename Real, typename Work>
double nanoseconds(const Work& work, int repeats) {
  using Clock = std::chrono::steady_clock;
  static const auto angles = views<Real>();
  double least = 1e30;
  for (int round = 0; round < 9; ++round) {
    const auto start = Clock::now();
    double sum = 0;
    for (int i = 0; i < repeats; ++i) {
      for (const ViewAngle<Real>& view : angles) sum += work(view);
    }
    keep(sum);
    const std::chrono::duration<double, std::nano> spent = Clock::now() - start;
    least = std::min(least, spent.count() / (repeats * 64.0));
  }
  return least;
}

// The largest relative deviation of both integrals from the O(1) algorithm.
template <typename Real, typename Work>
double deviation(double exponent, const Work& work) {
  double worst = 0;
  const auto exact = views<double>();
  const auto angles = views<Real>();
  for (std::size_t i = 0; i < angles.size(); ++i) {
    const auto [phong, modified] = work(angles[i]);
    worst = std::max({worst, std::abs(phong / phong_energy(exponent, exact[i]).value - 1),
                      std::abs(modified / modified_phong_energy(exponent, exact[i]).value - 1)});
  }
  return worst;
}

void run() {
  using namespace boost::math::policies;
  const policy<> promoting;
  const policy<promote_double<false>> plain;
  std::printf(
      "| exponent | O(1) | with derivatives | float | O(n) | off | published | off | "
      "no long double | off | in float, off |\n|%s\n",
      "---|---|---|---|---|---|---|---|---|---|---|");
  double crossover = 0;
  for (const int n :
       {1, 2, 3, 5, 10, 19, 20, 30, 50, 100, 200, 500, 1000, 10000, 100000, 1000000}) {
    const double exponent = n;
    const auto exponent_float = static_cast<float>(n);
    const auto fast = [=](const ViewAngle<double>& view) {
      return phong_energy(exponent, view).value + modified_phong_energy(exponent, view).value;
    };
    const auto slopes = [=](const ViewAngle<double>& view) {
      const auto p = phong_energy(exponent, view), m = modified_phong_energy(exponent, view);
      return p.value + m.value + p.by_exponent + m.by_exponent + p.by_angle + m.by_angle;
    };
    const auto single = [=](const ViewAngle<float>& view) {
      return phong_energy(exponent_float, view).value +
             modified_phong_energy(exponent_float, view).value;
    };
    const auto summed = [=](const ViewAngle<double>& view) {
      return Values{summed_phong_energy(n, view), summed_modified_phong_energy(n, view)};
    };
    const auto published = [&](const ViewAngle<double>& view) {
      return as_published(exponent, view, promoting);
    };
    const auto unpromoted = [&](const ViewAngle<double>& view) {
      return as_published(exponent, view, plain);
    };
    const auto published_float = [&](const ViewAngle<float>& view) {
      return as_published(exponent_float, view, promoting);
    };
    const auto both = [](const auto& work) {
      return [&](const auto& view) {
        const Values values = work(view);
        return values.phong + values.modified;
      };
    };
    const double constant = nanoseconds<double>(fast, 100);
    const double sum = nanoseconds<double>(both(summed), std::max(1, 3000 / n));
    if (crossover == 0 && constant < sum) crossover = exponent;
    std::printf("| %d | %.0f | %.0f | %.0f | %.0f | %.0e | %.0f | %.0e | %.0f | %.0e | %.0e |\n", n,
                constant, nanoseconds<double>(slopes, 100), nanoseconds<float>(single, 100), sum,
                deviation<double>(exponent, summed), nanoseconds<double>(both(published), 20),
                deviation<double>(exponent, published), nanoseconds<double>(both(unpromoted), 50),
                deviation<double>(exponent, unpromoted),
                deviation<float>(exponent, published_float));
    std::fflush(stdout);
  }
  std::printf("O(1) is faster than the sum from an exponent of %g on.\n", crossover);
}

}  // namespace
}  // namespace lobefit

int main() { lobefit::run(); }
