// Functions of the view angle: what the curve nodes of a node group hold.
#pragma once

#include <Eigen/Core>
#include <cstddef>
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
  explicit ViewCurve(std::vector<Point> points);

  double operator()(double cosine) const;
  const std::vector<Point>& points() const { return points_; }
  bool constant() const { return points_.size() == 1; }

  // As few points as follow the function within the tolerance (Ramer, Douglas and Peucker); one
  // point where a constant does.
  static ViewCurve following(const std::function<double(double)>& function, double tolerance);

 private:
  std::vector<Point> points_;
  // Of each step of the tables, the first point that is not before it; empty of a constant.
  std::vector<std::size_t> first_;
};

// The cubic B-splines in which curves are fitted: uniform in sqrt(cosine), so that they are finest
// at grazing angles and smooth at normal incidence; constant where sqrt(cosine) is below
// least_root. Their coefficients have the size of the curve, and not less than 0 keep it so. A
// single coefficient is a constant.
class ViewSplines {
 public:
  static constexpr double least_root = 0.15;
  // As many as a search has until it knows its way.
  static constexpr int coarse = 13;

  // The splines that are not 0 at a view angle, of so many, and their values, of the sum 1.
  struct Support {
    int first;
    Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 4, 1> share;
  };
  static Support at(double cosine, int count);

  using Coefficients = Eigen::Ref<const Eigen::VectorXd>;
  static double evaluate(const Coefficients& coefficients, double cosine);

  // The same curve by splines of half the width, 2 n - 3 for n: Chaikin's and Catmull and Clark's
  // subdivision of cubic splines.
  static Eigen::VectorXd subdivided(const Coefficients& coefficients);
  // The sqrt(cosine) that coefficient i of so many stands for: the middle of its spline.
  static double centre(int i, int count);
};

}  // namespace lobefit
