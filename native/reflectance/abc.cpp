#include "reflectance/abc.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "measurement/input_error.h"
#include "reflectance/fresnel.h"

namespace lobefit {
namespace {

struct AbcFit {
  std::string_view name;
  std::array<double, 3> diffuse;  // k_D
  std::array<double, 3> a;
  double b;
  double c;
  double ior;
};

// The supplemental material of Low et al. 2012, fits of the ABC microfacet model.
constexpr std::array<AbcFit, 20> abc_fits = {{
    {"alum-bronze",
     {0.024514, 0.022346, 0.01622},
     {51.714554, 37.932693, 27.373095},
     10482.133789,
     0.816737,
     2.236525},
    {"black-obsidian",
     {0.0, 0.0, 0.0},
     {1447.612183, 1281.373169, 1313.115601},
     223549.90625,
     1.196914,
     1.485313},
    {"blue-acrylic",
     {0.011106, 0.035057, 0.104254},
     {1191.397339, 1099.257202, 1082.125366},
     255868.953125,
     1.084736,
     1.475061},
    {"chrome",
     {0.002692, 0.00252, 0.003088},
     {986.846741, 771.035522, 696.134583},
     64661.257812,
     1.90542,
     99.999413},
    {"gold-metallic-paint",
     {0.009164, 0.005649, 0.000424},
     {1.68563, 1.147257, 0.418757},
     53.738525,
     1.51173,
     9.031934},
    {"green-latex",
     {0.071622, 0.106434, 0.047407},
     {0.61866, 0.699535, 0.42756},
     701732.25,
     0.230061,
     3.772501},
    {"hematite",
     {0.0, 0.000273, 0.000528},
     {1261.585449, 1214.30542, 1255.108643},
     453901.0,
     1.011091,
     2.480358},
    {"nickel",
     {0.006227, 0.006663, 0.007587},
     {36.614742, 32.745403, 28.906111},
     705.733887,
     1.945258,
     5.441883},
    {"pearl-paint",
     {0.181452, 0.16215, 0.136895},
     {0.843725, 0.714731, 0.493903},
     30.882542,
     1.941556,
     9.303603},
    {"pink-felt",
     {0.267287, 0.17859, 0.15637},
     {0.225846, 0.226874, 0.221785},
     54.853024,
     0.344321,
     2.938402},
    {"red-fabric2",
     {0.116616, 0.012705, 0.002205},
     {0.586502, 0.141217, 0.134042},
     8092575.0,
     0.084146,
     1.976978},
    {"red-plastic",
     {0.268, 0.044432, 0.010675},
     {1.081538, 1.045352, 1.037089},
     34.117554,
     1.529797,
     1.66645},
    {"special-walnut-224",
     {0.008121, 0.004822, 0.003478},
     {0.704096, 0.69349, 0.676845},
     15.779606,
     2.668091,
     1.883156},
    {"specular-black-phenolic",
     {0.001379, 0.001737, 0.001891},
     {2866.697021, 2568.570068, 3042.953613},
     291094.21875,
     1.252478,
     1.415415},
    {"steel",
     {0.006151, 0.008683, 0.011281},
     {5709.654297, 4641.991211, 4419.819824},
     234651.921875,
     1.401774,
     2.658189},
    {"teflon",
     {0.321152, 0.313597, 0.305526},
     {1.787717, 1.816174, 1.846979},
     41.644257,
     2.066234,
     1.611215},
    {"two-layer-silver",
     {0.0, 0.0, 0.0},
     {125.852753, 121.561691, 119.139694},
     1048834.875,
     0.598443,
     8.718435},
    {"violet-rubber",
     {0.2325, 0.04523, 0.108831},
     {0.840866, 0.796264, 0.822774},
     371.841339,
     0.646749,
     2.143676},
    {"white-diffuse-bball",
     {0.319956, 0.272448, 0.178031},
     {2.10485, 2.082304, 2.011517},
     75.010391,
     1.9402,
     1.693726},
    {"white-marble",
     {0.222139, 0.208435, 0.183381},
     {349.57486, 331.314941, 323.574066},
     49167.527344,
     1.153413,
     1.650249},
}};

Rgb evaluate(const AbcFit& fit, const HalfDifference& point) {
  const auto [wi, wo] = to_directions(point);
  const double half = std::cos(point.theta_h), incidence = std::cos(point.theta_d);
  const double masking =
      std::min({1.0, 2 * half * wi.z() / incidence, 2 * half * wo.z() / incidence});
  // 1 - cos theta_h by the half angle, because b is up to 8e6.
  const double rise = 2 * std::pow(std::sin(point.theta_h / 2), 2);
  const double shape = fresnel_reflectance(incidence, fit.ior).value * masking /
                       (wi.z() * wo.z() * std::pow(1 + fit.b * rise, fit.c));
  const Rgb diffuse(fit.diffuse.data()), a(fit.a.data());
  return (diffuse + a * shape) / pi;
}

}  // namespace

std::vector<std::string_view> sample_names() {
  std::vector<std::string_view> names;
  names.reserve(abc_fits.size());
  for (const AbcFit& fit : abc_fits) names.push_back(fit.name);
  return names;
}

Measurement sample_measurement(std::string_view name) {
  const auto fit = std::find_if(abc_fits.begin(), abc_fits.end(),
                                [=](const AbcFit& f) { return f.name == name; });
  if (fit == abc_fits.end()) {
    throw InputError("sample: expected one of " + std::to_string(abc_fits.size()) +
                     " materials (nickel, red-fabric2, ..), found '" + std::string(name) + "'.");
  }
  return Measurement::tabulate([=](const HalfDifference& at) { return evaluate(*fit, at); });
}

}  // namespace lobefit
