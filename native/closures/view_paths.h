// Ways through the best closures of single view angles: starts for curves that fit all of them.
#pragma once

#include <map>
#include <vector>

#include "closures/closure_problem.h"

namespace lobefit {

// At a single view angle closures are fitted in an instant, from many starts, to many local optima.
// Curves that are fitted to all angles at once get stuck where the best closures change their
// places from one angle to the next. So the ways from optimum to optimum are found whose errors,
// together with how much they jump, are least (Viterbi's algorithm), and curves start from there.
class ViewPaths {
 public:
  // The diffuse closure alone at each view.
  ViewPaths(const SearchTarget& views, int threads, const Monitor& monitor);

  // Goes on to one specular closure more: found from the best optima with another of any width, and
  // then from what is best at the angles beside. Throws Cancelled.
  void add_closure(const Monitor& monitor);

  // The best ways, for each choice of distributions and each reluctance to jump.
  std::vector<ClosureCurves> ways() const;

 private:
  // Closures at one view, with what they add to its light and what they look like there.
  struct Optimum {
    ClosureCurves closures;
    double error;
    Eigen::VectorXd light;
    std::vector<Shape> shapes;
  };
  using Optima = std::vector<Optimum>;
  using OptimaByView = std::vector<Optima>;
  using Path = std::vector<const Optimum*>;  // one of each view

  Optima optima_from(std::size_t view, const std::vector<ClosureCurves>& starts,
                     const Monitor& monitor) const;
  Optimum optimum(std::size_t view, const ClosureCurves& start, const Monitor& monitor) const;
  void spread(OptimaByView& optima, const Monitor& monitor) const;
  std::vector<ClosureCurves> ways(const OptimaByView& optima) const;
  Path way(const OptimaByView& optima, double reluctance) const;
  ClosureCurves through(const Path& path) const;
  static Optima distinct(Optima optima);
  static Optima in_every_order(const Optimum& optimum);
  static double jump(const Optimum& from, const Optimum& to);

  std::vector<SearchTarget> views_;  // each of one view
  std::map<std::vector<Distribution>, OptimaByView> by_distributions_;
  int threads_;
};

}  // namespace lobefit
