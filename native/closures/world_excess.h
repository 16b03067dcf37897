// What Cycles, until release 4.5, shows of bent closures in a white world but not under lamps.
#pragma once

#include <Eigen/Core>
#include <span>

#include "closures/microfacet.h"

namespace lobefit {

// In each channel, a part of the white that is shown; and its derivatives by the weights, columns
// closure after closure, the diffuse one last, three channels each.
struct WorldExcess {
  Rgb albedo = Rgb::Zero();
  Eigen::Matrix3Xd by_weights;
};

// A direction that Cycles draws for closure k may end beyond that closure's own horizon, which
// makes it black under a lamp. There Cycles adds up the light of k by its formula and of the
// others, and divides by the density with which any of them draws that direction: in all
//
//   sum_k int_{R_k} a_k (w_k f_k + sum_{j != k} w_j f_j) dwi,
//   a_k = p_k q_k / (p_k q_k + sum_{j != k} p_j q_j),
//
// more than all lamps together show, R_k what lies between the horizons of k and of the surface, p
// the mean of a weight's channels, q the density of a closure alone. Within .07 of it.
//
// At most most_specular_closures, seen from one viewer; the weights, of 3 rows, have a column for
// each and one for the diffuse closure. Derivatives are given where they are asked for.
template <bool derivatives>
WorldExcess world_excess(std::span<const Microfacet> closures,
                         const Eigen::Ref<const Eigen::Matrix3Xd>& weights);

}  // namespace lobefit
