# Copyright 2026 pam_actuation developers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""
HTML pages about recorded runs: metrics, zoomable plots, rules, replay, gap.

``pages.bag_report`` writes the page of one or several bags, ``demo_page.demo_report`` that of the
demo, and ``gap.write_gap`` the result folder of a gap look. ``metrics`` holds the figures of merit
as pure functions; ``sections`` one file per kind of section.
A page is one file that needs no network.
"""
