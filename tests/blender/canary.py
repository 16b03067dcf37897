"""`./dev test` expects this test to fail: a runner that reports it as passed reports nothing."""


def test_canary():
    raise AssertionError("this failure is expected")
