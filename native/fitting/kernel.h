// The innermost loop of a fit: one run of samples against one lobe.
#pragma once

#include <cstddef>

namespace lobefit {

// What a run is compared with. Everything is in units of the median reflectance.
struct KernelInput {
  std::size_t count;  // a multiple of Samples::padding
  const double* u_phong;
  const double* u_blinn;
  const float* weight;
  int channels;                 // 1 to 3, all with the same exponent
  const float* measured[3][2];  // [channel][half]
  double diffuse[3];            // rho_d / pi
  double specular[3];           // k_s
  double exponent, interpolation;
  // R_F of the run and its two derivatives by the third shape variable.
  double fresnel, fresnel_slope, fresnel_curvature;
  double smoothing;  // e of the smoothed L1; unused by the square norms
  bool newton;       // which w the matrix gets, see KernelSums
};

// Sums over the run, from which value, gradient J'Wr and matrix J'WJ follow. With g = R_F base^s,
// the model is f_c = diffuse_c + specular_c g; x are the shape variables (log s, alpha, third).
// R = W r with W = rho'(r) / (2 r), the weight of iteratively reweighted squares. The sums that
// make the matrix have the same W or, for Newton's method, rho''(r) / 2; its matrix also has what
// the curvature of the model adds, the sums of R times second derivatives. Pairs of shape variables
// are in the order 00, 01, 02, 11, 12, 22.
struct KernelSums {
  double value;       // sum of rho(r), the smoothed objective
  double true_value;  // sum of weight |r|, or of r^2 for the square norms
  double w[3], wg[3], wgg[3];
  double r[3], rg[3];
  double wx[3][3], wgx[3][3];  // [channel][shape variable]
  double rx[3][3];             // R dg/dx
  double wxx[6];               // W dg/dx dg/dy, times k_s^2 and summed over the channels
  double rxx[6];               // R d2g/dxdy, times k_s and summed over the channels
};

// log_l2 compares log(f + log_offset), in units of the median.
inline constexpr double log_offset = 0.01;

enum class KernelNorm { smoothed_l1, l2, log_l2 };

KernelSums run_kernel(const KernelInput& input, KernelNorm norm);

// base^s of `count` lobe coordinates, a multiple of 4; 0 where the base is not positive.
struct PowerInput {
  std::size_t count;
  const double* u_phong;
  const double* u_blinn;
  double exponent, interpolation;
};
void run_powers(const PowerInput& input, double* powers);

}  // namespace lobefit
