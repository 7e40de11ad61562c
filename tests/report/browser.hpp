// SPDX-License-Identifier: Apache-2.0
/// @file
/// A report page opened in a real browser, which tells what it drew.
#pragma once

#include <array>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "io/file.hpp"
#include "io/json_output.hpp"
#include "io/temporary_folder.hpp"

namespace trammel::test {

/// What the page says about itself after drawing.
struct PageCheck {
  io::Json errors;
  io::Json drawn;
  std::string dom;
};

#ifdef TRAMMEL_CHROMIUM

inline std::string output_of(const std::string& command) {
  std::string text;
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(::popen(command.c_str(), "r"), ::pclose);
  std::array<char, 65536> buffer{};
  while (const std::size_t count = std::fread(buffer.data(), 1, buffer.size(), pipe.get())) {
    text.append(buffer.data(), count);
  }
  return text;
}

inline std::string unescaped(std::string text) {
  for (const auto& [from, to] :
       {std::pair<std::string, std::string>{"&quot;", "\""}, {"&lt;", "<"}, {"&amp;", "&"}}) {
    for (auto at = text.find(from); at != std::string::npos; at = text.find(from, at + 1)) {
      text.replace(at, from.size(), to);
    }
  }
  return text;
}

inline PageCheck open_page(const std::string& html) {
  const TemporaryFolder folder;
  const auto page = folder.write("report.html", html);
  PageCheck check;
  check.dom = output_of(
      "HOME=" + folder.path().string() +
      " timeout 120 " TRAMMEL_CHROMIUM
      " --headless --no-sandbox --disable-gpu --disable-background-networking --disable-dev-shm-usage"
      " --window-size=1200,900 --virtual-time-budget=8000 --user-data-dir=" +
      (folder.path() / "profile").string() + " --dump-dom 'file://" + page.string() + "#check' 2>" +
      (folder.path() / "log").string());
  const std::string mark = "data-check=\"";
  const auto begin = check.dom.find(mark);
  if (begin == std::string::npos) {
    ADD_FAILURE() << "the page did not check itself: " << io::read_text(folder.path() / "log");
    return check;
  }
  const auto end = check.dom.find('"', begin + mark.size());
  const io::Json json =
      io::Json::parse(unescaped(check.dom.substr(begin + mark.size(), end - begin - mark.size())));
  check.errors = json.at("errors");
  check.drawn = json.at("drawn");
  return check;
}

#endif

}  // namespace trammel::test
