#include "reflectance/phong_energy.h"

namespace lobefit {
namespace {

struct SummedIntegrals {
  double wallis;
  double beta;
};

// W_m and beta_m from those of m = 0 or 1 upward.
SummedIntegrals summed_integrals(int m, const ViewAngle<double>& view) {
  const auto [cosine, sine] = view;
  SummedIntegrals at = m % 2 == 0 ? SummedIntegrals{pi / 2, std::atan2(cosine, sine) / (pi / 2)}
                                  : SummedIntegrals{1, cosine};
  double power = cosine * (m % 2 == 0 ? sine : sine * sine);
  for (int k = m % 2; k < m; k += 2) {
    at.beta += power / ((k + 1) * at.wallis);
    at.wallis *= (k + 1.0) / (k + 2);
    power *= sine * sine;
  }
  return at;
}

}  // namespace

double summed_phong_energy(int exponent, const ViewAngle<double>& view) {
  return pi / (exponent + 1.0) * (1 + summed_integrals(exponent, view).beta);
}

double summed_modified_phong_energy(int exponent, const ViewAngle<double>& view) {
  const SummedIntegrals above = summed_integrals(exponent + 1, view);
  const double edge = pi / ((exponent + 1) * above.wallis) * std::pow(view.sine, exponent + 2);
  return (pi * view.cosine * (1 + above.beta) + edge) / (exponent + 2.0);
}

}  // namespace lobefit
