#include "closures/view_curve.h"

#include <algorithm>
#include <cmath>

namespace lobefit {
namespace {

constexpr int steps = 256;

// Marks the points needed between two that are kept, by the one that is farthest off the line.
void keep_needed(const std::vector<ViewCurve::Point>& all, std::size_t from, std::size_t to,
                 double tolerance, std::vector<bool>& kept) {
  double worst = tolerance;
  std::size_t farthest = 0;
  for (std::size_t i = from + 1; i < to; ++i) {
    const double share = (all[i].cosine - all[from].cosine) / (all[to].cosine - all[from].cosine);
    const double off =
        std::abs(all[from].value + share * (all[to].value - all[from].value) - all[i].value);
    if (off > worst) {
      worst = off;
      farthest = i;
    }
  }
  if (farthest == 0) return;
  kept[farthest] = true;
  keep_needed(all, from, farthest, tolerance, kept);
  keep_needed(all, farthest, to, tolerance, kept);
}

}  // namespace

ViewCurve::ViewCurve(std::vector<Point> points) : points_(std::move(points)) {
  if (constant()) return;
  std::size_t next = 0;
  for (int step = 0; step <= steps; ++step) {
    while (next < points_.size() && points_[next].cosine < double(step) / steps) ++next;
    first_.push_back(next);
  }
}

double ViewCurve::operator()(double cosine) const {
  if (constant()) return points_.front().value;
  const auto step = static_cast<std::size_t>(std::clamp(cosine, 0.0, 1.0) * steps);
  std::size_t above = first_[step];
  while (above < points_.size() && points_[above].cosine < cosine) ++above;
  if (above == 0) return points_.front().value;
  if (above == points_.size()) return points_.back().value;
  const Point &low = points_[above - 1], &high = points_[above];
  const double share = (cosine - low.cosine) / (high.cosine - low.cosine);
  return low.value + share * (high.value - low.value);
}

ViewCurve ViewCurve::following(const std::function<double(double)>& function, double tolerance) {
  std::vector<Point> all;
  for (int i = 0; i <= steps; ++i) {
    const double cosine = double(i) / steps;
    all.push_back({cosine, function(cosine)});
  }
  const auto [least, greatest] = std::minmax_element(
      all.begin(), all.end(), [](const Point& a, const Point& b) { return a.value < b.value; });
  if (greatest->value - least->value <= 2 * tolerance) {
    return ViewCurve((least->value + greatest->value) / 2);
  }
  std::vector<bool> kept(all.size(), false);
  kept.front() = kept.back() = true;
  keep_needed(all, 0, all.size() - 1, tolerance, kept);
  std::vector<Point> points;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (kept[i]) points.push_back(all[i]);
  }
  return ViewCurve(std::move(points));
}

ViewSplines::Support ViewSplines::at(double cosine, int count) {
  if (count == 1) return {0, Eigen::Matrix<double, 1, 1>(1)};
  const int intervals = count - 3;
  const double root = std::sqrt(std::clamp(cosine, 0.0, 1.0));
  const double place = intervals * std::clamp((root - least_root) / (1 - least_root), 0.0, 1.0);
  const int first = std::min(static_cast<int>(place), intervals - 1);
  const double t = place - first, u = 1 - t;
  return {first, Eigen::Vector4d(u * u * u / 6, (3 * t * t * t - 6 * t * t + 4) / 6,
                                 (3 * u * u * u - 6 * u * u + 4) / 6, t * t * t / 6)};
}

double ViewSplines::evaluate(const Coefficients& coefficients, double cosine) {
  const Support support = at(cosine, static_cast<int>(coefficients.size()));
  return support.share.dot(coefficients.segment(support.first, support.share.size()));
}

Eigen::VectorXd ViewSplines::subdivided(const Coefficients& coefficients) {
  const auto& c = coefficients;
  Eigen::VectorXd finer(2 * c.size() - 3);
  for (Eigen::Index i = 0; i < finer.size(); ++i) {
    const Eigen::Index j = (i + 1) / 2;
    finer[i] = i % 2 == 0 ? (c[j] + c[j + 1]) / 2 : (c[j - 1] + 6 * c[j] + c[j + 1]) / 8;
  }
  return finer;
}

double ViewSplines::centre(int i, int count) {
  const double share = std::clamp((i - 1) / double(count - 3), 0.0, 1.0);
  return least_root + share * (1 - least_root);
}

}  // namespace lobefit
