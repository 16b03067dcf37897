// Functions of the view angle: what the curve nodes of a node group hold.
#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <vector>

namespace lobefit {

// A piecewise linear function of the cosine of the view angle, as Cycles evaluates a curve node
// with vector handles: constant beyond its first and last point. Blender and Cycles read a curve
// through tables of 256 equal steps from its first to its last point; points from 0 to 1 at
// multiples of 1/256 stand on their entries, so that the tables lose nothing.
class ViewCurve {
 public:
  struct Point {
    double cosine;
    double value;
  };

  ViewCurve() : ViewCurve(0.0) {}
  // The constant.
  explicit ViewCurve(double value) : points_{{0, value}} {}
  // At least one point, cosines from 0 to 1 ascending.
  explicit ViewCurve(std::vector<Point> points) : points_(std::move(points)) {}

  double operator()(double cosine) const;
  const std::vector<Point>& points() const { return points_; }
  bool constant() const { return points_.size() == 1; }

  // As few points as follow the function within the tolerance (Ramer, Douglas and Peucker); one
  // point where a constant does.
  static ViewCurve following(const std::function<double(double)>& function, double tolerance);

 private:
  std::vector<Point> points_;
};

// The cubic B-splines in which curves are fitted: uniform in sqrt(cosine), so that they are finest
// at grazing angles and smooth at normal incidence; constant where sqrt(cosine) is below
// least_root. Their coefficients have the size of the curve, and not less than 0 keep it so.
class ViewSplines {
 public:
  static constexpr int count = 13;
  static constexpr double least_root = 0.15;

  // The four splines that are not 0 at a view angle.
  struct Support {
    int first;
    std::array<double, 4> share;  // their values, of the sum 1
  };
  static Support at(double cosine);

  static double evaluate(const double* coefficients, double cosine);
};

}  // namespace lobefit
