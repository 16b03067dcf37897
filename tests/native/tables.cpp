#include "tables.h"

#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "reflectance/abc.h"
#include "reflectance/fresnel.h"

namespace lobefit {
namespace {

using BinValue = std::function<Rgb(int h, int d, int p)>;

const Rgb no_value = Rgb::Constant(-1);

// A number in [0, 1) that is a bin's own, the same in every run (the finaliser of MurmurHash3).
double chance(int h, int d, int p) {
  auto bits = static_cast<std::uint32_t>(Measurement::index(h, d, p));
  bits = (bits ^ bits >> 16) * 0x85ebca6bU;
  bits = (bits ^ bits >> 13) * 0xc2b2ae35U;
  return static_cast<double>(bits ^ bits >> 16) / 4294967296.0;
}

// The bins of a model, changed.
Measurement changed(const Parameters& model,
                    const std::function<Rgb(int h, int d, int p, const Rgb& value)>& change) {
  return table_of([=](int h, int d, int p) {
    return change(h, d, p, evaluate_model(model, Measurement::centre(h, d, p)));
  });
}

Parameters scaled(Parameters parameters, double factor) {
  parameters.diffuse *= factor;
  parameters.specular *= factor;
  return parameters;
}

ExtremeTable of_model(std::string name, const Parameters& truth, bool degenerate = false) {
  return {std::move(name), [=] { return table_of(truth); }, truth, degenerate};
}

// The index of refraction of `wanted` lies closer to 1 than the fit goes; k_s makes up for the
// reflectance at normal incidence.
ExtremeTable of_nearly_no_interface(const Parameters& wanted, double nearest_ior) {
  Parameters truth = wanted;
  truth.ior = nearest_ior;
  truth.specular *=
      fresnel_reflectance(1, *wanted.ior).value / fresnel_reflectance(1, nearest_ior).value;
  return {"eta = 1 + 1e-9", [=] { return table_of(wanted); }, truth, true};
}

void add_shapes(std::vector<ExtremeTable>& tables) {
  for (int decade = -3; decade <= 7; ++decade) {
    tables.push_back(of_model("s = 1e" + std::to_string(decade),
                              lobe_of(std::pow(10.0, decade), 0.5, 1.5), decade < 0));
  }
  tables.push_back(of_model("alpha = 0", lobe_of(50, 0, 1.5)));
  tables.push_back(of_model("alpha = 1e-12", lobe_of(50, 1e-12, 1.5)));
  tables.push_back(of_model("alpha = 1 - 1e-12", lobe_of(50, 1 - 1e-12, 1.5)));
  tables.push_back(of_model("alpha = 1", lobe_of(50, 1, 1.5)));
  tables.push_back(of_nearly_no_interface(lobe_of(50, 0.5, 1 + 1e-9), 1.0001));
  tables.push_back(of_model("eta = 1.0001", lobe_of(50, 0.5, 1.0001), true));
  for (const auto& [name, ior] : {std::pair{"eta = 1.01", 1.01},
                                  {"eta = 1.5", 1.5},
                                  {"eta = 3", 3.0},
                                  {"eta = 10", 10.0},
                                  {"eta = 100", 100.0}}) {
    tables.push_back(of_model(name, lobe_of(50, 0.5, ior)));
  }
  Parameters ridge = lobe_of(50, 0.5, 1.0001);
  ridge.specular.setConstant(1e7);
  tables.push_back(of_model("k_s = 1e7, eta = 1.0001", ridge, true));
  // It lights the first bin of theta_h alone, and so there is no telling its width: that a lobe is
  // found at all is not asked.
  tables.push_back(
      {"lobe narrower than a bin", [] { return table_of(lobe_of(1e8, 0.5, 1.5)); }, {}, true});
}

void add_magnitudes(std::vector<ExtremeTable>& tables) {
  const Parameters lobe = lobe_of(50, 0.5, 1.5);
  tables.push_back(of_model("times 1e-30", scaled(lobe, 1e-30)));
  tables.push_back(of_model("times 1e30", scaled(lobe, 1e30)));
  tables.push_back(of_model("times 1e-310 (denormals)", scaled(lobe, 1e-310)));
  Parameters on_black = lobe;
  on_black.diffuse.setConstant(1e-40);
  tables.push_back(of_model("a lobe on 1e-40", on_black));
  on_black.diffuse.setZero();
  on_black.exponent.setConstant(1000);
  tables.push_back(of_model("a lobe on black", on_black));
  tables.push_back({"one bin of 1e300",
                    [=] {
                      return changed(lobe, [](int h, int d, int p, const Rgb& value) {
                        return h == 10 && d == 20 && p == 30 ? Rgb::Constant(1e300) : value;
                      });
                    },
                    lobe});
}

void add_degenerate(std::vector<ExtremeTable>& tables) {
  Parameters flat;
  flat.diffuse = {0.5, 0.4, 0.3};
  tables.push_back(of_model("constant", flat, true));
  flat.diffuse.setConstant(0.5);
  tables.push_back(of_model("constant and grey", flat, true));
  tables.push_back(of_model("all zero", Parameters{}, true));
  tables.push_back({"one bright bin",
                    [] {
                      return table_of([](int h, int d, int p) {
                        return Rgb::Constant(h == 0 && d == 45 && p == 90 ? 1000 : 0);
                      });
                    },
                    Parameters{}, true});
  tables.push_back({"one valid bin",
                    [] {
                      return table_of([](int h, int d, int p) {
                        return h == 5 && d == 40 && p == 50 ? Rgb(0.3, 0.2, 0.1) : no_value;
                      });
                    },
                    {},
                    true});
}

void add_damaged(std::vector<ExtremeTable>& tables) {
  const Parameters lobe = lobe_of(50, 0.5, 1.5);
  const auto damaged = [&](const char* name, auto change) {
    tables.push_back({name, [=] { return changed(lobe, change); }, lobe});
  };
  damaged("99 % invalid", [](int h, int d, int p, const Rgb& value) {
    return chance(h, d, p) < 0.99 ? no_value : value;
  });
  damaged("checkerboard of invalid bins",
          [](int h, int d, int p, const Rgb& value) { return (h + d + p) % 2 ? no_value : value; });
  damaged("25 % spikes", [](int h, int d, int p, const Rgb& value) {
    return chance(h, d, p) < 0.25 ? Rgb(100 * value) : value;
  });
  damaged("49 % spikes", [](int h, int d, int p, const Rgb& value) {
    return chance(h, d, p) < 0.49 ? Rgb(100 * value) : value;
  });
  // Nothing tells which half are the spikes, so there is no truth to be found.
  damaged("50 % spikes", [](int h, int d, int p, const Rgb& value) {
    return chance(h, d, p) < 0.5 ? Rgb(100 * value) : value;
  });
  tables.back().truth.reset();
}

void add_other_models(std::vector<ExtremeTable>& tables) {
  for (const char* name : {"steel", "red-fabric2"}) {
    tables.push_back(
        {"ABC sample " + std::string(name), [=] { return sample_measurement(name); }, {}});
  }
  tables.push_back({"mirror with a step",
                    [] {
                      return table_of([](int h, int d, int) {
                        return Rgb::Constant(h < 9 ? 100 : d < 45 ? 0.1 : 0.3);
                      });
                    },
                    {}});
}

}  // namespace

std::vector<ExtremeTable> extreme_tables() {
  std::vector<ExtremeTable> tables;
  add_shapes(tables);
  add_magnitudes(tables);
  add_degenerate(tables);
  add_damaged(tables);
  add_other_models(tables);
  return tables;
}

Measurement no_valid_bin() {
  return table_of([](int, int, int) { return no_value; });
}

Parameters lobe_of(double exponent, double interpolation, double ior) {
  Parameters parameters;
  parameters.diffuse = {0.2, 0.15, 0.1};
  parameters.specular =
      Rgb(0.3, 0.25, 0.2) * ((exponent + 2) / (2 * pi) / fresnel_reflectance(1, ior).value);
  parameters.exponent.setConstant(exponent);
  parameters.interpolation = interpolation;
  parameters.ior = ior;
  return parameters;
}

Measurement table_of(const Parameters& parameters) {
  return table_of([&](int h, int d, int p) {
    return evaluate_model(parameters, Measurement::centre(h, d, p));
  });
}

Measurement noisy_table_of(const Parameters& parameters, double noise) {
  return Measurement::tabulate([&](const HalfDifference& at) -> Rgb {
    const double phase = 1e4 * at.theta_h + 7e3 * at.theta_d + 3e3 * at.phi_d;
    return evaluate_model(parameters, at) * (1 + noise * std::sin(phase));
  });
}

Measurement table_of(const BinValue& value) {
  return Measurement([&](int h, const Measurement::Rows& rows) {
    for (int i = 0; i < Measurement::row_size; ++i) {
      const Rgb rgb = value(h, i / Measurement::phi_d_bins, i % Measurement::phi_d_bins);
      for (int c = 0; c < 3; ++c) rows[static_cast<std::size_t>(c)][i] = rgb[c];
    }
  });
}

}  // namespace lobefit
