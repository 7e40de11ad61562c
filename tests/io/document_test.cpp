// SPDX-License-Identifier: Apache-2.0
#include "io/document.hpp"

#include <string>

#include <gtest/gtest.h>

#include "io/file.hpp"
#include "trammel/core/error.hpp"

namespace {

using trammel::io::Document;

std::string error_of(const std::function<void()>& work) {
  try {
    work();
  } catch (const trammel::Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(Document, TomlErrorsNameFileLineAndKey) {
  const auto document = Document::parse_toml("[bounds]\nposition_m = \"far\"\n", "a.toml");
  const std::string message = error_of([&] { (void)document.root().at("bounds").at("position_m").number(); });
  EXPECT_EQ(message, "a.toml:2: bounds.position_m: found \"far\", expected a number");
}

TEST(Document, UnknownKeysAreRejectedWithTheirLine) {
  const auto document = Document::parse_toml("title = \"x\"\n[bounds]\nposition_n = 3\n", "a.toml");
  (void)document.root().at("title").text();
  (void)document.root().at("bounds");
  const std::string message = error_of([&] { document.reject_unknown(); });
  EXPECT_NE(message.find("a.toml:3: bounds.position_n"), std::string::npos) << message;
}

TEST(Document, JsonAndTomlGiveTheSameTree) {
  const auto toml =
      Document::parse_toml("a = [1, 2.5]\nb = {start = 0, stop = 0.3, step = 0.1}\nc = inf", "t");
  const auto json = Document::parse_json(
      R"({"a": [1, 2.5], "b": {"start": 0, "stop": 0.3, "step": 0.1}, "c": Infinity})", "j");
  for (const Document* document : {&toml, &json}) {
    EXPECT_EQ(document->root().at("a").numbers(), (std::vector<double>{1, 2.5}));
    EXPECT_EQ(document->root().at("b").range_or_numbers().size(), 4U);
    EXPECT_TRUE(std::isinf(document->root().at("c").number_or_infinity()));
    document->reject_unknown();
  }
}

TEST(Document, BadSyntaxNamesTheLine) {
  const std::string toml = error_of([] { (void)Document::parse_toml("a = 1\nb = = 2\n", "a.toml"); });
  EXPECT_EQ(toml.rfind("a.toml:2", 0), 0U) << toml;
  const std::string json = error_of([] { (void)Document::parse_json("{\"a\": 1,\n \"b\": }", "a.json"); });
  EXPECT_NE(json.find("line 2"), std::string::npos) << json;
}

TEST(File, Sha256KnownAnswer) {
  EXPECT_EQ(trammel::io::sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

}  // namespace
