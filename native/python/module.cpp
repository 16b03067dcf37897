// lobefit._native: the C++ core as Python sees it. Conversion alone;
// native/python/lobefit/_native.pyi has the types.
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <array>
#include <bit>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "closures/closure_set.h"
#include "closures/compute_record.h"
#include "closures/fit_closures.h"
#include "closures/live_lobe.h"
#include "closures/principled.h"
#include "fitting/error_figures.h"
#include "fitting/fit.h"
#include "fitting/job.h"
#include "fitting/minimise.h"
#include "fitting/naive_ceres.h"
#include "fitting/samples.h"
#include "fitting/variables.h"
#include "inverse/normals.h"
#include "inverse/shading.h"
#include "measurement/input_error.h"
#include "measurement/input_file.h"
#include "measurement/instructions.h"
#include "measurement/measurement.h"
#include "measurement/merl.h"
#include "measurement/parallel.h"
#include "measurement/read_measurement.h"
#include "measurement/rgl.h"
#include "preview/phong_terms.h"
#include "preview/two_lights.h"
#include "reflectance/abc.h"
#include "reflectance/classic.h"
#include "reflectance/model.h"
#include "reflectance/phong_energy.h"

namespace py = pybind11;

namespace lobefit {
namespace {

using SharedMeasurement = std::shared_ptr<Measurement>;
using RecordJob = Job<RecordContents>;
using ClosureJob = Job<FittedClosures>;
using NormalsJob = Job<Normals>;
using DirectionArray = py::array_t<double, py::array::c_style | py::array::forcecast>;

std::vector<double> to_list(const Rgb& rgb) { return {rgb[0], rgb[1], rgb[2]}; }

// dict["key"] as three numbers; one number stands for three equal ones.
Rgb rgb_from(const py::dict& dict, const char* key) {
  if (!dict.contains(key)) throw InputError(std::string("parameters: '") + key + "' is missing.");
  const py::object value = dict[key];
  if (!py::isinstance<py::sequence>(value)) return Rgb::Constant(value.cast<double>());
  const auto list = value.cast<std::vector<double>>();
  if (list.size() != 3) {
    throw InputError(std::string("parameters: '") + key + "' needs three numbers, found " +
                     std::to_string(list.size()) + ".");
  }
  return {list[0], list[1], list[2]};
}

double number_from(const py::dict& dict, const char* key, double otherwise) {
  if (!dict.contains(key) || dict[key].is_none()) return otherwise;
  return dict[key].cast<double>();
}

Parameters parameters_from(const py::dict& dict) {
  Parameters parameters;
  parameters.kind = model_named(dict["model"].cast<std::string>());
  parameters.diffuse = rgb_from(dict, "diffuse");
  parameters.specular = rgb_from(dict, "specular");
  parameters.exponent = rgb_from(dict, "exponent");
  parameters.interpolation = number_from(dict, "interpolation", 0);
  const double ior = number_from(dict, "ior", std::numeric_limits<double>::quiet_NaN());
  if (!std::isnan(ior)) parameters.ior = ior;
  return parameters;
}

py::dict to_dict(const Parameters& parameters) {
  using namespace py::literals;
  const Rgb& s = parameters.exponent;
  const bool shared = s[0] == s[1] && s[1] == s[2];
  const bool interpolated = parameters.kind == ModelKind::interpolated;
  return py::dict(
      "model"_a = std::string(name_of(parameters.kind)), "diffuse"_a = to_list(parameters.diffuse),
      "specular"_a = to_list(parameters.specular),
      "exponent"_a = shared ? py::object(py::float_(s[0])) : py::object(py::cast(to_list(s))),
      "interpolation"_a =
          interpolated ? py::object(py::float_(parameters.interpolation)) : py::object(py::none()),
      "ior"_a = parameters.ior ? py::object(py::float_(*parameters.ior)) : py::object(py::none()));
}

Principled principled_from(const py::dict& dict) {
  return {rgb_from(dict, "base_color"),      number_from(dict, "metallic", 0),
          number_from(dict, "roughness", 0), number_from(dict, "ior", 1.5),
          rgb_from(dict, "specular_tint"),   number_from(dict, "error", 0)};
}

py::dict to_dict(const Principled& principled) {
  using namespace py::literals;
  return py::dict("base_color"_a = to_list(principled.base_color),
                  "metallic"_a = principled.metallic, "roughness"_a = principled.roughness,
                  "ior"_a = principled.ior, "specular_tint"_a = to_list(principled.specular_tint),
                  "error"_a = principled.error);
}

// A curve as a list of points [cosine, value], three curves as a list of curves.
py::list to_list(const ViewCurve& curve) {
  py::list list;
  for (const ViewCurve::Point& point : curve.points()) {
    list.append(std::vector<double>{point.cosine, point.value});
  }
  return list;
}

py::list to_list(const RgbCurve& curves) {
  py::list list;
  for (const ViewCurve& curve : curves) list.append(to_list(curve));
  return list;
}

ViewCurve curve_from(const py::handle& list) {
  std::vector<ViewCurve::Point> points;
  for (const auto& [cosine, value] : list.cast<std::vector<std::pair<double, double>>>()) {
    points.push_back({cosine, value});
  }
  if (points.empty()) throw InputError("closures: a curve needs a point.");
  return ViewCurve(std::move(points));
}

RgbCurve curves_from(const py::handle& list) {
  const auto curves = list.cast<std::array<py::object, 3>>();
  return {curve_from(curves[0]), curve_from(curves[1]), curve_from(curves[2])};
}

py::dict to_dict(const FittedClosures& fitted) {
  using namespace py::literals;
  py::list specular, angles, target, closures, errors;
  for (const SpecularClosure& closure : fitted.closures.specular) {
    specular.append(py::dict(
        "distribution"_a = std::string(name_of(closure.distribution)),
        "roughness"_a = to_list(closure.roughness), "anisotropy"_a = to_list(closure.anisotropy),
        "bend"_a = to_list(closure.bend), "weight"_a = to_list(closure.weight)));
  }
  for (const SeenAtAngle& seen : fitted.by_view) {
    angles.append(degrees(std::acos(seen.cosine)));
    target.append(to_list(seen.target_albedo));
    closures.append(to_list(seen.closures_albedo));
    errors.append(seen.relative_error);
  }
  return py::dict(
      "error"_a = fitted.error, "diffuse"_a = to_list(fitted.closures.diffuse),
      "specular"_a = specular,
      "by_view"_a = py::dict("view_angle"_a = angles, "target_albedo"_a = target,
                             "closures_albedo"_a = closures, "relative_error"_a = errors));
}

ClosureSet closures_from(const py::dict& dict) {
  ClosureSet closures{curves_from(dict["diffuse"]), {}};
  for (const py::handle item : dict["specular"]) {
    const auto specular = item.cast<py::dict>();
    closures.specular.push_back({distribution_named(specular["distribution"].cast<std::string>()),
                                 curve_from(specular["roughness"]),
                                 curve_from(specular["anisotropy"]), curve_from(specular["bend"]),
                                 curves_from(specular["weight"])});
  }
  return closures;
}

py::dict to_dict(const BinCounts& bins) {
  using namespace py::literals;
  return py::dict("valid"_a = bins.valid, "below_horizon"_a = bins.below_horizon,
                  "negative"_a = bins.negative, "non_finite"_a = bins.non_finite);
}

py::dict to_dict(const ErrorFigure& figure) {
  using namespace py::literals;
  return py::dict("pooled"_a = figure.pooled, "rgb"_a = to_list(figure.rgb));
}

py::dict to_dict(const ErrorFigures& errors) {
  using namespace py::literals;
  return py::dict("l1"_a = to_dict(errors.l1), "relative_l1"_a = to_dict(errors.relative_l1),
                  "relative_l1_80"_a = to_dict(errors.relative_l1_80),
                  "relative_l1_cosine"_a = to_dict(errors.relative_l1_cosine));
}

// The ends of `count` steps from 0 to 90 deg, the first one's beginning too; `power` 2 makes them
// grow as the bins of theta_h do.
std::vector<double> angles_between(int count, int power) {
  std::vector<double> ends;
  for (int i = 0; i <= count; ++i) ends.push_back(90 * std::pow(double(i) / count, power));
  return ends;
}

template <typename Parts>
std::pair<py::list, py::list> columns_of(const Parts& parts) {
  py::list misfit, measured;
  for (const ErrorByAngle::Part& part : parts) {
    misfit.append(part.misfit);
    measured.append(part.measured);
  }
  return {misfit, measured};
}

py::dict to_dict(const ErrorByAngle& errors) {
  using namespace py::literals;
  py::list misfit, measured;
  for (const auto& row : errors.half_difference) {
    const auto [row_misfit, row_measured] = columns_of(row);
    misfit.append(row_misfit);
    measured.append(row_measured);
  }
  const auto [view_misfit, view_measured] = columns_of(errors.view);
  return py::dict(
      "half_difference"_a = py::dict("theta_h"_a = angles_between(ErrorByAngle::cells, 2),
                                     "theta_d"_a = angles_between(ErrorByAngle::cells, 1),
                                     "misfit"_a = misfit, "measured"_a = measured),
      "view"_a = py::dict("view_angle"_a = angles_between(ErrorByAngle::views, 1),
                          "misfit"_a = view_misfit, "measured"_a = view_measured));
}

py::dict to_dict(const Uncertainty& uncertainty, const FitOptions& options) {
  using namespace py::literals;
  py::list correlation;
  for (const auto& row : uncertainty.correlation.rowwise()) {
    correlation.append(std::vector<double>(row.begin(), row.end()));
  }
  return py::dict(
      "confidence"_a = Uncertainty::confidence, "blocks"_a = uncertainty.blocks,
      "seconds"_a = uncertainty.seconds, "low"_a = to_dict(uncertainty.low),
      "high"_a = to_dict(uncertainty.high), "undetermined"_a = uncertainty.undetermined,
      "variables"_a = Variables(options.kind, options.fresnel, options.separate_channels).names(),
      "correlation"_a = correlation);
}

py::list to_list(const std::vector<Stage>& stages) {
  using namespace py::literals;
  py::list list;
  for (const Stage& stage : stages) {
    list.append(py::dict("name"_a = stage.name, "l1"_a = stage.error, "seconds"_a = stage.seconds,
                         "iterations"_a = stage.iterations));
  }
  return list;
}

py::list to_list(const std::vector<Rgb>& colours) {
  py::list list;
  for (const Rgb& colour : colours) list.append(to_list(colour));
  return list;
}

py::dict to_dict(const RecordContents& contents, const FitOptions& options) {
  using namespace py::literals;
  const Fit& fit = contents.fit;
  const Certainty& certainty = fit.certainty;
  return py::dict(
      "model"_a = std::string(name_of(options.kind)), "parameters"_a = to_dict(fit.parameters),
      "error"_a = to_dict(fit.errors), "error_by_angle"_a = to_dict(fit.errors.by_angle),
      "uncertainty"_a =
          fit.uncertainty ? py::object(to_dict(*fit.uncertainty, options)) : py::object(py::none()),
      "schedule"_a = std::string(name_of(options.schedule)),
      "norm"_a = std::string(name_of(options.norm)),
      "channels"_a = options.separate_channels ? "separate" : "shared",
      "max_angle"_a = options.max_angle_degrees, "stages"_a = to_list(fit.stages),
      "seconds"_a = py::dict("read"_a = contents.read_seconds, "start"_a = fit.start_seconds,
                             "fit"_a = fit.fit_seconds, "total"_a = contents.total_seconds),
      "converged"_a = fit.converged,
      "certainty"_a = py::dict("starts"_a = certainty.starts, "agree"_a = certainty.agree,
                               "spread"_a = certainty.spread),
      "albedo"_a = py::dict("view_angle"_a = contents.albedo.view_angle,
                            "measured"_a = to_list(contents.albedo.measured),
                            "model"_a = to_list(contents.albedo.model)),
      "warnings"_a = fit.warnings, "bins"_a = to_dict(contents.bins),
      "format"_a = contents.measurement->source().format,
      "principled"_a = to_dict(contents.principled));
}

// f (or f cos) for each row of two (N, 3) arrays of unit vectors.
py::array_t<double> evaluate_rows(const Reflectance& reflectance, const DirectionArray& wi,
                                  const DirectionArray& wo) {
  if (wi.ndim() != 2 || wo.ndim() != 2 || wi.shape(1) != 3 || wo.shape(1) != 3 ||
      wi.shape(0) != wo.shape(0)) {
    throw InputError("directions: expected two arrays of the same shape (N, 3).");
  }
  const py::ssize_t count = wi.shape(0);
  py::array_t<double> result({count, py::ssize_t{3}});
  const double* in = wi.data();
  const double* out = wo.data();
  double* values = result.mutable_data();
  const py::gil_scoped_release release;
  for (py::ssize_t i = 0; i < 3 * count; i += 3) {
    Eigen::Map<Rgb>(values + i) = reflectance(Vector3(in + i), Vector3(out + i));
  }
  return result;
}

Reflectance with_cosine(Reflectance reflectance) {
  return [reflectance = std::move(reflectance)](const Vector3& wi, const Vector3& wo) {
    return Rgb(reflectance(wi, wo) * std::max(wi.z(), 0.0));
  };
}

Reflectance model_reflectance(const Parameters& parameters) {
  return [=](const Vector3& wi, const Vector3& wo) { return evaluate_model(parameters, wi, wo); };
}

Reflectance live_reflectance(const Parameters& parameters) {
  return [=](const Vector3& wi, const Vector3& wo) { return live_lobe(parameters, wi, wo); };
}

Reflectance principled_reflectance(const Principled& principled) {
  return
      [=](const Vector3& wi, const Vector3& wo) { return evaluate_principled(principled, wi, wo); };
}

// A row of value, by_exponent and by_angle for each exponent and angle in degrees, (N) each.
py::array_t<double> phong_energy_rows(bool modified, const DirectionArray& exponent,
                                      const DirectionArray& angle) {
  if (exponent.ndim() != 1 || angle.ndim() != 1 || exponent.size() != angle.size()) {
    throw InputError("energy: expected as many exponents as angles.");
  }
  py::array_t<double> result({exponent.size(), py::ssize_t{3}});
  auto rows = result.mutable_unchecked<2>();
  for (py::ssize_t i = 0; i < exponent.size(); ++i) {
    const auto view = ViewAngle<double>::from_degrees(angle.at(i));
    const double n = exponent.at(i);
    const auto energy = modified ? modified_phong_energy(n, view) : phong_energy(n, view);
    rows(i, 0) = energy.value;
    rows(i, 1) = energy.by_exponent;
    rows(i, 2) = energy.by_angle;
  }
  return result;
}

using FloatArray = py::array_t<float, py::array::c_style | py::array::forcecast>;

// Phong's specular term or an alteration of it at normals (3, N).
py::array_t<float> phong_terms(const std::string& term, double exponent, int gamma,
                               const std::array<double, 3>& light,
                               const std::array<double, 3>& viewer, const FloatArray& normals,
                               bool lanes) {
  if (normals.ndim() != 2 || normals.shape(0) != 3 || normals.size() == 0) {
    throw InputError("normals: expected an array of shape (3, N).");
  }
  if (gamma != 4 && gamma != 8 && gamma != 16 && gamma != 32) {
    throw InputError("gamma: expected 4, 8, 16 or 32, found " + std::to_string(gamma) + ".");
  }
  const PhongTermInput input{phong_term_named(term),
                             exponent,
                             std::countr_zero(static_cast<unsigned>(gamma)),
                             Vector3(light.data()),
                             Vector3(viewer.data()),
                             static_cast<std::size_t>(normals.shape(1)),
                             {normals.data(0, 0), normals.data(1, 0), normals.data(2, 0)}};
  py::array_t<float> result(normals.shape(1));
  float* terms = result.mutable_data();
  const py::gil_scoped_release release;
  lanes ? phong_terms_in_lanes(input, terms) : phong_terms_one_by_one(input, terms);
  return result;
}

// Rows of (N, 5) cos theta, exponent, interpolation, ior and fresnel; a row of LiveAlbedo each.
py::array_t<double> live_albedo_rows(const DirectionArray& arguments) {
  if (arguments.ndim() != 2 || arguments.shape(1) != 5) {
    throw InputError("arguments: expected an array of shape (N, 5).");
  }
  const py::ssize_t count = arguments.shape(0);
  py::array_t<double> result({count, py::ssize_t{3}});
  const double* in = arguments.data();
  double* out = result.mutable_data();
  const py::gil_scoped_release release;
  for (py::ssize_t i = 0; i < count; ++i, in += 5, out += 3) {
    const LiveAlbedo albedo = live_albedo(in[0], in[1], in[2], in[3], in[4]);
    out[0] = albedo.until_4_5;
    out[1] = albedo.since_5_0;
    out[2] = albedo.weight;
  }
  return result;
}

Reflectance measured_reflectance(SharedMeasurement measurement) {
  return [measurement = std::move(measurement)](const Vector3& wi, const Vector3& wo) {
    return measurement->evaluate(wi, wo);
  };
}

ClassicMaterial classic_from(const py::dict& dict) {
  const auto model = dict["model"].cast<std::string>();
  if (model != "classic-phong" && model != "classic-blinn-phong") {
    throw InputError("model: expected 'classic-phong' or 'classic-blinn-phong', found '" + model +
                     "'.");
  }
  return {rgb_from(dict, "diffuse"), rgb_from(dict, "specular"), rgb_from(dict, "exponent"),
          model == "classic-blinn-phong"};
}

py::dict matched_exponent(double exponent, std::optional<double> angle) {
  using namespace py::literals;
  const py::gil_scoped_release release;
  const auto radians = angle ? std::optional(*angle * pi / 180) : std::nullopt;
  const ExponentMatch match = match_exponent(exponent, radians);
  const py::gil_scoped_acquire acquire;
  return py::dict("exponent"_a = match.exponent, "error"_a = match.error,
                  "error_of_four"_a = match.error_of_four);
}

std::pair<std::string, py::dict> named_source(const py::object& source) {
  try {
    return source.cast<std::pair<std::string, py::dict>>();
  } catch (const py::cast_error&) {
    throw InputError(
        "source: expected a Measurement, a dict of parameters or a pair of a name and a dict, "
        "found " +
        py::type::of(source).attr("__name__").cast<std::string>() + ".");
  }
}

// f cos of what a preview can show: a Measurement, a dict of parameters, ("live", parameters),
// ("principled", its dict), ("classic", its dict) or ("closures", an entry of a record's closures).
Reflectance previewed(const py::object& source) {
  if (py::isinstance<Measurement>(source)) {
    return with_cosine(measured_reflectance(source.cast<SharedMeasurement>()));
  }
  if (py::isinstance<py::dict>(source)) {
    return with_cosine(model_reflectance(parameters_from(source.cast<py::dict>())));
  }
  const auto [kind, dict] = named_source(source);
  if (kind == "live") return live_reflectance(parameters_from(dict));
  if (kind == "principled") return principled_reflectance(principled_from(dict));
  if (kind == "closures") return closures_reflectance(closures_from(dict));
  if (kind == "classic") return classic_reflectance(classic_from(dict));
  throw InputError("source: expected 'live', 'principled', 'classic' or 'closures', found '" +
                   kind + "'.");
}

py::array_t<float> preview(const py::object& source, int size, double world) {
  if (size < 1 || size > 8192) {
    throw InputError("preview: expected a size of 1 to 8192 pixels, found " + std::to_string(size) +
                     ".");
  }
  if (!(world >= 0 && world <= 1e6)) {
    throw InputError("preview: expected a world of radiance 0 to 1e6, found " +
                     std::to_string(world) + ".");
  }
  const Reflectance reflectance = previewed(source);
  std::vector<float> pixels;
  {
    const py::gil_scoped_release release;
    pixels = render_two_lights(reflectance, size, world);
  }
  return py::array_t<float>({size, size, 3}, pixels.data());
}

Rgb rgb_from(const std::array<double, 3>& list) { return {list[0], list[1], list[2]}; }

// A list with a dict for each picture: `lights`, a list of pairs of direction and irradiance,
// `ambient` and `exposure`. lobefit.lights has checked all of it.
std::vector<Lighting> lighting_from(const py::list& pictures) {
  std::vector<Lighting> lighting;
  for (const py::handle picture : pictures) {
    Lighting& each = lighting.emplace_back();
    each.ambient = rgb_from(picture["ambient"].cast<std::array<double, 3>>());
    each.exposure = picture["exposure"].cast<double>();
    for (const py::handle light : picture["lights"]) {
      const auto [direction, irradiance] =
          light.cast<std::pair<std::array<double, 3>, std::array<double, 3>>>();
      each.lights.push_back({Vector3(direction.data()).normalized(), rgb_from(irradiance)});
    }
  }
  return lighting;
}

using MaskArray = py::array_t<bool, py::array::c_style | py::array::forcecast>;

// Pictures (K, rows, columns, 3) and the mask (rows, columns) of the surface.
Pictures pictures_from(const FloatArray& values, const MaskArray& mask,
                       std::vector<Lighting> lighting, float saturation) {
  if (values.ndim() != 4 || values.shape(3) != 3 || mask.ndim() != 2 ||
      values.shape(1) != mask.shape(0) || values.shape(2) != mask.shape(1)) {
    throw InputError("pictures: expected arrays of (K, rows, columns, 3) and (rows, columns).");
  }
  if (values.shape(0) != static_cast<py::ssize_t>(lighting.size()) || lighting.empty()) {
    throw InputError("pictures: expected one or more, each with its lighting.");
  }
  Pictures pictures{{static_cast<int>(mask.shape(0)),
                     static_cast<int>(mask.shape(1)),
                     {mask.data(), mask.data() + mask.size()}},
                    std::move(lighting),
                    {},
                    saturation};
  const auto one = static_cast<py::ssize_t>(3 * pictures.grid.size());
  for (py::ssize_t k = 0; k < values.shape(0); ++k) {
    pictures.values.emplace_back(values.data() + k * one, values.data() + (k + 1) * one);
  }
  return pictures;
}

std::unique_ptr<NormalsJob> start_normals_job(const FloatArray& values, const MaskArray& mask,
                                              const py::list& lighting, const py::object& source,
                                              double floor, double noise, float saturation,
                                              int threads) {
  if (!(floor > 0)) throw InputError("floor: expected a value above 0.");
  if (!(noise >= 0)) throw InputError("noise: expected a value of at least 0.");
  if (threads < 0) throw InputError("threads: expected 0 (all) or more, found a negative number.");
  return std::make_unique<NormalsJob>(
      [pictures = pictures_from(values, mask, lighting_from(lighting), saturation),
       reflectance = previewed(source), options = NormalsOptions{floor, noise, threads}](
          Monitor& monitor) { return estimate_normals(pictures, reflectance, options, monitor); });
}

// Normals (rows, columns, 3) and heights (rows, columns).
py::tuple to_arrays(const Normals& found) {
  const py::ssize_t rows = found.grid.rows, columns = found.grid.columns;
  py::array_t<float> normals({rows, columns, py::ssize_t{3}}), heights({rows, columns});
  float* normal = normals.mutable_data();
  for (const Vector3& each : found.normals) {
    normal = std::copy(each.begin(), each.end(), normal);
  }
  std::copy(found.heights.begin(), found.heights.end(), heights.mutable_data());
  return py::make_tuple(normals, heights);
}

// What pixels with these normals, (N, 3), show under each lighting: (K, N, 3).
py::array_t<float> shaded(const py::object& source, const DirectionArray& normals,
                          const py::list& pictures) {
  if (normals.ndim() != 2 || normals.shape(1) != 3) {
    throw InputError("normals: expected an array of shape (N, 3).");
  }
  const Reflectance reflectance = previewed(source);
  const std::vector<Lighting> lighting = lighting_from(pictures);
  const py::ssize_t count = normals.shape(0);
  py::array_t<float> result({static_cast<py::ssize_t>(lighting.size()), count, py::ssize_t{3}});
  float* value = result.mutable_data();
  const py::gil_scoped_release release;
  const Shading shading(reflectance, lighting);
  for (std::size_t k = 0; k < lighting.size(); ++k) {
    for (py::ssize_t i = 0; i < count; ++i) {
      const SeenPoint point(Vector3(normals.data() + 3 * i));
      for (const double channel : shading.value(point, lighting[k])) {
        *value++ = static_cast<float>(channel);
      }
    }
  }
  return result;
}

// What records tell as the error of closures and of the best Principled BSDF.
double picture_error(const SharedMeasurement& measurement, const py::object& shown) {
  const Reflectance reflectance = previewed(shown);
  const py::gil_scoped_release release;
  return error_of(sample_target(measured_reflectance(measurement)), reflectance);
}

// A read-only view of the table that keeps the measurement alive.
py::array_t<double> values_of(const SharedMeasurement& measurement) {
  py::array_t<double> view(
      {3, Measurement::theta_h_bins, Measurement::theta_d_bins, Measurement::phi_d_bins},
      measurement->planes().data(), py::cast(measurement));
  view.attr("flags").attr("writeable") = false;
  return view;
}

SharedMeasurement tabulated(const Parameters& parameters) {
  return std::make_shared<Measurement>(Measurement::tabulate(
      [&](const HalfDifference& at) { return evaluate_model(parameters, at); }));
}

SharedMeasurement from_values(const DirectionArray& values) {
  if (values.ndim() != 4 || values.size() != 3 * py::ssize_t{Measurement::bin_count}) {
    throw InputError("values: expected an array of shape (3, 90, 90, 180).");
  }
  return std::make_shared<Measurement>(
      std::span<const double>(values.data(), static_cast<std::size_t>(values.size())));
}

// Everything about the job that its thread needs to be told.
struct PythonJob {
  PythonJob(MeasurementSource source, const FitOptions& asked)
      : options(asked), job([source = std::move(source), asked](Monitor& monitor) {
          return compute_record(source, asked, monitor);
        }) {}

  FitOptions options;
  RecordJob job;
};

std::unique_ptr<PythonJob> start_job(const py::object& source, const std::string& model,
                                     bool fresnel, const std::string& schedule,
                                     const std::string& norm, double max_angle,
                                     const std::string& channels, bool uncertainty, int threads) {
  FitOptions options;
  options.kind = model_named(model);
  options.fresnel = fresnel;
  options.schedule = schedule_named(schedule);
  options.norm = norm_named(norm);
  if (!(max_angle > 0 && max_angle <= 90)) {
    throw InputError("max_angle: expected degrees above 0 and up to 90, found " +
                     std::to_string(max_angle) + ".");
  }
  options.max_angle_degrees = max_angle;
  if (channels != "shared" && channels != "separate") {
    throw InputError("channels: expected shared or separate, found '" + channels + "'.");
  }
  options.separate_channels = channels == "separate";
  options.uncertainty = uncertainty;
  if (threads < 0) throw InputError("threads: expected 0 (all) or more, found a negative number.");
  options.threads = threads;
  if (py::isinstance<Measurement>(source)) {
    return std::make_unique<PythonJob>(source.cast<std::shared_ptr<const Measurement>>(), options);
  }
  return std::make_unique<PythonJob>(source.cast<std::filesystem::path>(), options);
}

// The closures of a Measurement or of a dict of parameters: `count` specular ones, or with a
// negative count as few as stay within the tolerance.
std::unique_ptr<ClosureJob> start_closure_job(const py::object& source, int count, double tolerance,
                                              bool cap_albedo, int threads) {
  if (count > most_specular_closures) {
    throw InputError("closures: expected at most " + std::to_string(most_specular_closures) +
                     ", found " + std::to_string(count) + ".");
  }
  if (threads < 0) throw InputError("threads: expected 0 (all) or more, found a negative number.");
  const Reflectance target = py::isinstance<Measurement>(source)
                                 ? measured_reflectance(source.cast<SharedMeasurement>())
                                 : model_reflectance(parameters_from(source.cast<py::dict>()));
  const ClosureFitOptions options{std::max(count, 0), cap_albedo, threads};
  return std::make_unique<ClosureJob>([=](Monitor& monitor) {
    const Target sampled = sample_target(target, threads);
    return count >= 0 ? fit_closures(sampled, options, monitor)
                      : fit_closures_within(sampled, tolerance, options, monitor);
  });
}

// The result of a job that Python waits for; Ctrl-C ends it.
template <typename Result>
Result finished(std::function<Result(Monitor&)> work) {
  Job<Result> job(std::move(work));
  const auto wait = [&job] {
    const py::gil_scoped_release release;
    return job.wait(std::chrono::milliseconds(50));
  };
  while (!wait()) {
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  }
  return job.result();
}

// Rows of the samples: a column for each half, so for each bin, of those that weigh.
py::dict to_columns(const Samples& samples) {
  using namespace py::literals;
  std::vector<double> u_phong, u_blinn, cos_theta_d, weight;
  std::array<std::vector<double>, 3> measured;
  for (const Samples::Run& run : samples.runs) {
    for (std::size_t i = run.begin; i < run.end; ++i) {
      for (std::size_t half = 0; half < 2 && samples.weight[i] > 0; ++half) {
        u_phong.push_back(samples.u_phong[i]);
        u_blinn.push_back(samples.u_blinn[i]);
        cos_theta_d.push_back(run.cos_theta_d);
        weight.push_back(samples.weight[i]);
        for (std::size_t c = 0; c < 3; ++c) measured[c].push_back(samples.measured[c][half][i]);
      }
    }
  }
  const auto array = [](const std::vector<double>& column) {
    return py::array_t<double>(static_cast<py::ssize_t>(column.size()), column.data());
  };
  return py::dict("u_phong"_a = array(u_phong), "u_blinn"_a = array(u_blinn),
                  "cos_theta_d"_a = array(cos_theta_d), "weight"_a = array(weight),
                  "red"_a = array(measured[0]), "green"_a = array(measured[1]),
                  "blue"_a = array(measured[2]));
}

py::dict l1_problem(const Measurement& measurement, int bins) {
  using namespace py::literals;
  const Variables variables(ModelKind::interpolated, true, false);
  const auto list = [](const Eigen::VectorXd& x) {
    return std::vector<double>(x.begin(), x.end());
  };
  const Samples samples = samples_for_others(measurement, bins, 0);
  return py::dict("unit"_a = samples.unit, "smoothing"_a = fine_precision().finest,
                  "lower"_a = list(variables.lower()), "upper"_a = list(variables.upper()),
                  "columns"_a = to_columns(samples));
}

Parameters start_of(const SharedMeasurement& measurement, int threads) {
  return finished<Parameters>(
      [=](Monitor& monitor) { return best_start(*measurement, {.threads = threads}, monitor); });
}

py::dict fit_by(const SharedMeasurement& measurement, const std::string& schedule, int threads) {
  using namespace py::literals;
  const FitOptions options{.schedule = schedule_named(schedule), .threads = threads};
  const Fit fit =
      finished<Fit>([=](Monitor& monitor) { return fit_model(*measurement, options, monitor); });
  int iterations = 0;
  double touched = 0;
  for (const Stage& stage : fit.stages) {
    iterations += stage.iterations;
    touched += stage.touched;
  }
  // A sample is two bins, but for the few whose other half is invalid.
  const auto bins =
      std::min(static_cast<int>(2 * fit.stages.back().samples), measurement->bins().valid);
  return py::dict("parameters"_a = to_dict(fit.parameters), "error"_a = to_dict(fit.errors),
                  "bins"_a = bins, "iterations"_a = iterations, "converged"_a = fit.converged,
                  "touched"_a = 2 * touched);
}

py::dict fit_naively_by(const SharedMeasurement& measurement, const py::dict& start, int bins,
                        int threads) {
  using namespace py::literals;
  const NaiveFit fit = finished<NaiveFit>([=, from = parameters_from(start)](Monitor& monitor) {
    return fit_naively(samples_for_others(*measurement, bins, threads), from, threads, monitor);
  });
  return py::dict(
      "parameters"_a = to_dict(fit.parameters),
      "error"_a = to_dict(error_figures(*measurement, fit.parameters, thread_count(threads))),
      "bins"_a = fit.bins, "iterations"_a = fit.iterations, "converged"_a = fit.converged,
      "touched"_a = static_cast<double>(fit.passes) * fit.bins, "seconds"_a = fit.seconds);
}

template <typename Owner>
void bind_job_methods(py::class_<Owner>& bound, auto job_of) {
  bound
      .def_property_readonly(
          "progress", [=](Owner& o) { return job_of(o).progress(); },
          "The share that is done, from 0 to 1.")
      .def_property_readonly(
          "stage", [=](Owner& o) { return job_of(o).stage(); },
          "What is being done, in a word or two.")
      .def_property_readonly(
          "done", [=](Owner& o) { return job_of(o).done(); },
          "Whether `result` would answer at once.")
      .def(
          "cancel", [=](Owner& o) { job_of(o).cancel(); },
          "Asks the job to end soon; `result` then raises Cancelled.")
      .def(
          "wait",
          [=](Owner& o, double seconds) {
            const py::gil_scoped_release release;
            return job_of(o).wait(std::chrono::duration<double>(seconds));
          },
          py::arg("seconds"), "Waits up to that long; True when the job is done.");
}

void bind_measurement(py::module_& module) {
  py::class_<Measurement, SharedMeasurement>(
      module, "Measurement",
      "A measured isotropic reflectance on the grid of MERL tables, in 1/sr.")
      .def_static(
          "read",
          [](const std::filesystem::path& path) {
            const py::gil_scoped_release release;
            return std::make_shared<Measurement>(read_measurement(path));
          },
          py::arg("path"), "Reads a file; InputError says what is wrong with it.")
      .def_static(
          "from_model",
          [](const py::dict& parameters) { return tabulated(parameters_from(parameters)); },
          py::arg("parameters"), "The table of a model.")
      .def_static("from_values", &from_values, py::arg("values"),
                  "A table of shape (3, 90, 90, 180) in 1/sr; negative or not finite is invalid.")
      .def_property_readonly("values", &values_of,
                             "(3, 90, 90, 180) in 1/sr, NaN where invalid; read-only.")
      .def_property_readonly(
          "bins", [](const Measurement& m) { return to_dict(m.bins()); },
          "How many bins are `valid`, and how many are not because they are `below_horizon`, "
          "`negative` or `non_finite`.")
      .def_property_readonly(
          "format", [](const Measurement& m) { return m.source().format; },
          "The format of the file, MERL or RGL; MERL where there was no file.")
      .def_property_readonly(
          "warnings", [](const Measurement& m) { return m.source().warnings; },
          "What a user should know of how the file was read.")
      .def(
          "evaluate",
          [](const SharedMeasurement& m, const DirectionArray& wi, const DirectionArray& wo) {
            return evaluate_rows(measured_reflectance(m), wi, wo);
          },
          py::arg("wi"), py::arg("wo"),
          "f in 1/sr, (N, 3), between the bins; NaN where it is not known.")
      .def(
          "write",
          [](const Measurement& m, const std::filesystem::path& path) {
            const py::gil_scoped_release release;
            write_merl(m, path);
          },
          py::arg("path"), "Writes a MERL .binary file.");
}

void bind_rgl(py::module_& module) {
  py::class_<Rgl, std::shared_ptr<Rgl>>(module, "Rgl",
                                        "An RGL measurement at any directions, not as a table.")
      .def(py::init([](const std::filesystem::path& path) {
             const py::gil_scoped_release release;
             return std::make_shared<Rgl>(InputFile(path));
           }),
           py::arg("path"), "Reads a file; InputError says what is wrong with it.")
      .def_property_readonly(
          "isotropic", &Rgl::isotropic,
          "Whether the file tells nothing of turning: it has one or two azimuths of the light.")
      .def(
          "evaluate",
          [](const std::shared_ptr<Rgl>& rgl, const DirectionArray& wi, const DirectionArray& wo) {
            return evaluate_rows(
                [&](const Vector3& light, const Vector3& viewer) {
                  return rgl->evaluate(light, viewer);
                },
                wi, wo);
          },
          py::arg("wi"), py::arg("wo"),
          "f cos(theta_o) in 1/sr, (N, 3), as the file tells it: not made reciprocal, and negative "
          "where a colour is beyond the gamut.");
}

void bind_jobs(py::module_& module) {
  py::class_<PythonJob> fit(module, "FitJob", "A fit that runs in a thread of its own.");
  fit.def(py::init(&start_job), py::arg("source"), py::arg("model") = "interpolated",
          py::arg("fresnel") = true, py::arg("schedule") = "polish", py::arg("norm") = "l1",
          py::arg("max_angle") = 90.0, py::arg("channels") = "shared",
          py::arg("uncertainty") = false, py::arg("threads") = 0,
          "Starts at once; source is a path or a Measurement.");
  bind_job_methods(fit, [](PythonJob& p) -> RecordJob& { return p.job; });
  fit.def(
      "result", [](const PythonJob& p) { return to_dict(p.job.result(), p.options); },
      "The fit as a dict; raises what ended the job.");
  fit.def_property_readonly(
      "measurement",
      [](const PythonJob& p) {
        return std::const_pointer_cast<Measurement>(p.job.result().measurement);
      },
      "What was read and fitted, of a job that is done.");
  py::class_<ClosureJob> closures(module, "ClosureJob",
                                  "A search for closures that runs in a thread of its own.");
  closures.def(py::init(&start_closure_job), py::arg("source"), py::arg("count") = 2,
               py::arg("tolerance") = 0.0, py::arg("cap_albedo") = false, py::arg("threads") = 0,
               "Starts at once; source is a Measurement or a dict of parameters. A negative count "
               "stands for as few closures as stay within the tolerance.");
  bind_job_methods(closures, [](ClosureJob& job) -> ClosureJob& { return job; });
  closures.def(
      "result", [](const ClosureJob& job) { return to_dict(job.result()); },
      "The closures as a dict; raises what ended the job.");
  py::class_<NormalsJob> normals(module, "NormalsJob",
                                 "Normals from shading, in a thread of its own.");
  normals.def(py::init(&start_normals_job), py::arg("pictures"), py::arg("mask"),
              py::arg("lighting"), py::arg("source"), py::arg("floor"), py::arg("noise"),
              py::arg("saturation"), py::arg("threads") = 0,
              "Starts at once; lobefit.normals says what all of it is. source is as in preview.");
  bind_job_methods(normals, [](NormalsJob& job) -> NormalsJob& { return job; });
  normals.def(
      "result", [](const NormalsJob& job) { return to_arrays(job.result()); },
      "Normals (rows, columns, 3) in the camera's frame, 0 off the mask, and heights (rows, "
      "columns) in pixels; raises what ended the job.");
}

// The fit and its rivals, each waited for (lobefit.methods).
void bind_methods(py::module_& module) {
  module.def(
      "best_start",
      [](const SharedMeasurement& measurement, int threads) {
        return to_dict(start_of(measurement, threads));
      },
      py::arg("measurement"), py::arg("threads") = 0,
      "Where the fit of the interpolated model with Fresnel by L1 begins, as parameters.");
  module.def("l1_problem", &l1_problem, py::arg("measurement"), py::arg("bins") = 0,
             "What that fit ends on: the unit of reflectance in 1/sr and, in this unit, the "
             "smoothing of |r| and the bounds of rho_d/pi and k_s of three channels, log s, alpha "
             "and log(eta - 1). Its columns are those of about so many bins, drawn and weighted so "
             "that their optimum is that of all, or of all (0): the lobe's coordinates, the weight "
             "and red, green and blue as measured.");
  module.def("fit_by", &fit_by, py::arg("measurement"), py::arg("schedule"), py::arg("threads") = 0,
             "The interpolated model with Fresnel by L1: parameters, error, bins that the last "
             "step saw, iterations, converged, and touched, the bins of all passes together.");
  module.def("fit_naively", &fit_naively_by, py::arg("measurement"), py::arg("start"),
             py::arg("bins") = 0, py::arg("threads") = 0,
             "The same by Ceres with a residual block for each channel of about so many bins, "
             "drawn as in l1_problem; also seconds, without those of drawing and of the error "
             "figures.");
  module.def(
      "error_figures",
      [](const Measurement& measurement, const py::dict& parameters) {
        return to_dict(error_figures(measurement, parameters_from(parameters), thread_count(0)));
      },
      py::arg("measurement"), py::arg("parameters"), "The `error` of a record.");
}

void bind_errors(py::module_& module) {
  py::register_exception<InputError>(module, "InputError", PyExc_ValueError).attr("__doc__") =
      "A file or an argument is not as expected; one sentence says what was found in its place.";
  py::register_exception<Cancelled>(module, "Cancelled").attr("__doc__") =
      "What was under way was asked to end, and did.";
}

void bind_functions(py::module_& module) {
  module.def(
      "sample_names",
      [] {
        const auto names = sample_names();
        return std::vector<std::string>(names.begin(), names.end());
      },
      "The names of the sample measurements.");
  module.def(
      "sample",
      [](const std::string& name) {
        return std::make_shared<Measurement>(sample_measurement(name));
      },
      py::arg("name"), "The table of a published ABC fit (Low et al. 2012).");
  module.def(
      "evaluate_model",
      [](const py::dict& parameters, const DirectionArray& wi, const DirectionArray& wo) {
        return evaluate_rows(model_reflectance(parameters_from(parameters)), wi, wo);
      },
      py::arg("parameters"), py::arg("wi"), py::arg("wo"), "f in 1/sr, (N, 3).");
  module.def("phong_energy", &phong_energy_rows, py::arg("modified"), py::arg("exponent"),
             py::arg("angle"),
             "The integral of Phong's or modified Phong's lobe and its derivatives by exponent and "
             "angle (per radian), (N, 3), for (N) exponents and angles in degrees.");
  module.def("match_exponent", &matched_exponent, py::arg("exponent"), py::arg("angle"),
             "Blinn-Phong's exponent nearest to Phong's (0.1 to 1e8), its error and that of four "
             "times the exponent, at a view angle in degrees or over spheres (None).");
  module.def(
      "evaluate_classic",
      [](const py::dict& classic, const DirectionArray& wi, const DirectionArray& wo) {
        return evaluate_rows(
            [material = classic_from(classic)](const Vector3& light, const Vector3& viewer) {
              return evaluate_classic(material, light, viewer);
            },
            wi, wo);
      },
      py::arg("classic"), py::arg("wi"), py::arg("wo"),
      "What a light of i_d = i_s = 1 adds in the classic model, (N, 3).");
  module.def(
      "evaluate_live",
      [](const py::dict& parameters, const DirectionArray& wi, const DirectionArray& wo) {
        return evaluate_rows(live_reflectance(parameters_from(parameters)), wi, wo);
      },
      py::arg("parameters"), py::arg("wi"), py::arg("wo"),
      "f cos(theta_i) of the live node group as Cycles renders it, (N, 3).");
  module.def("phong_terms", &phong_terms, py::arg("term"), py::arg("exponent"), py::arg("gamma"),
             py::arg("light"), py::arg("viewer"), py::arg("normals"), py::arg("lanes"),
             "Phong's specular term ('exact') or an alteration of it ('half-vector', 'dot', "
             "'difference', 'cross') at normals (3, N), (N), one by one or in lanes; gamma is that "
             "of the last three.");
  module.def(
      "live_albedo", &live_albedo_rows, py::arg("arguments"),
      "What the specular closures of the live node group reflect of a white world until "
      "Blender 4.5 and since 5.0, and the sum of their weights, (N, 3), for k_s = 1 and rows "
      "of cos theta, exponent, interpolation, ior and fresnel, (N, 5).");
  module.def(
      "evaluate_principled",
      [](const py::dict& principled, const DirectionArray& wi, const DirectionArray& wo) {
        return evaluate_rows(principled_reflectance(principled_from(principled)), wi, wo);
      },
      py::arg("principled"), py::arg("wi"), py::arg("wo"),
      "f cos(theta_i) of a Principled BSDF as Cycles renders it, (N, 3).");
  module.def(
      "evaluate_closures",
      [](const py::dict& closures, const DirectionArray& wi, const DirectionArray& wo) {
        return evaluate_rows(closures_reflectance(closures_from(closures)), wi, wo);
      },
      py::arg("closures"), py::arg("wi"), py::arg("wo"),
      "f cos(theta_i) of an entry of a record's closures as Cycles renders it, (N, 3).");
  module.def("uses_avx2", &uses_avx2,
             "Whether the version of the code for AVX2 runs on this processor.");
  module.def("preview", &preview, py::arg("source"), py::arg("size"), py::arg("world") = 0.0,
             "The sphere under two lights and a world of the radiance `world` (0 to 1e6), "
             "(size, size, 3) linear, row 0 at the top. source: a Measurement, a dict of "
             "parameters, ('live', parameters), ('principled', its dict), ('closures', an entry of "
             "a record's closures) or ('classic', a dict of model 'classic-phong' or "
             "'classic-blinn-phong', diffuse k_d, specular k_s and exponent).");
  module.def("shade", &shaded, py::arg("source"), py::arg("normals"), py::arg("lighting"),
             "The pixels that normals (N, 3) have under each lighting, (K, N, 3), without shadows "
             "that other points cast; source is as in preview.");
  module.def("picture_error", &picture_error, py::arg("measurement"), py::arg("shown"),
             "The mean L1 difference of pictures of a sphere over all angles between light and "
             "viewer, relative to each; shown: what preview draws.");
}

}  // namespace
}  // namespace lobefit

PYBIND11_MODULE(_native, module) {
  module.doc() = "The compiled core of lobefit.";
  module.attr("version") = LOBEFIT_VERSION;
  module.attr("build_id") = LOBEFIT_BUILD_ID;
  lobefit::bind_errors(module);
  lobefit::bind_measurement(module);
  lobefit::bind_rgl(module);
  lobefit::bind_jobs(module);
  lobefit::bind_functions(module);
  lobefit::bind_methods(module);
}
