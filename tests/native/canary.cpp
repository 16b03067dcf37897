#include <gtest/gtest.h>

// `./dev test` expects this test to fail: a runner that reports it as passed reports nothing.
TEST(Canary, Fails) { FAIL() << "this failure is expected"; }
