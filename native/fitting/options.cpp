#include "fitting/options.h"

#include <array>
#include <string>
#include <utility>

#include "measurement/input_error.h"

namespace lobefit {
namespace {

constexpr std::array<std::pair<Norm, std::string_view>, 4> norm_names = {{
    {Norm::l1, "l1"},
    {Norm::cosine_l1, "cosine-l1"},
    {Norm::l2, "l2"},
    {Norm::log_l2, "log-l2"},
}};
constexpr std::array<std::pair<Schedule, std::string_view>, 4> schedule_names = {{
    {Schedule::stages, "stages"},
    {Schedule::polish, "polish"},
    {Schedule::joint, "joint"},
    {Schedule::subsample, "subsample"},
}};

template <typename Names, typename Value>
std::string_view find_name(const Names& names, Value value) {
  for (const auto& [candidate, name] : names) {
    if (candidate == value) return name;
  }
  return {};
}

template <typename Names>
auto find_value(const Names& names, std::string_view what, std::string_view name) {
  std::string known;
  for (const auto& [value, candidate] : names) {
    if (candidate == name) return value;
    known += (known.empty() ? "" : ", ") + std::string(candidate);
  }
  throw InputError(std::string(what) + ": expected one of " + known + ", found '" +
                   std::string(name) + "'.");
}

}  // namespace

std::string_view name_of(Norm norm) { return find_name(norm_names, norm); }
Norm norm_named(std::string_view name) { return find_value(norm_names, "norm", name); }
std::string_view name_of(Schedule schedule) { return find_name(schedule_names, schedule); }
Schedule schedule_named(std::string_view name) {
  return find_value(schedule_names, "schedule", name);
}

}  // namespace lobefit
