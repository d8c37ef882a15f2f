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
What rules and model add to the command.

A tick adds it. Where rules are exchanged, by a roll-back or from outside, the integral takes the
difference, so that the command makes no step.
"""

import numpy as np
from pam_actuation.control.sofc import muscle_model
from pam_actuation.control.sofc.records import OUTPUT, STATE
from pam_actuation.control.sofc.rule_table import (
    infer_feedback, infer_feedforward, infer_motion, layer, Tables)
from pam_actuation.control.sofc.settings import PARAMETERS
from pam_sim.annotations import FloatArray
from pam_sim.compiled import Compiled, compiled, entry_point, source_key
from pam_sim.records import part


@compiled
def rules_pa(par: np.record, values: Tables, out: np.record) -> tuple[float, float, float]:
    """
    Return the output of feedback, feed-forward and motion rules [Pa].

    ``out`` is an ``OUTPUT`` that says which rules are active. The latter two are in full, of which
    ``rules_share`` acts.
    """
    feedback, feedforward, motion, _ = values
    share = out.contracting_share
    return (
        par.feedback_gain_pa * infer_feedback(
            feedback, share, int(out.error_set), out.error_degree,
            int(out.change_set), out.change_degree),
        infer_feedforward(
            feedforward, share, int(out.reference_knot), out.reference_knot_degree),
        infer_motion(
            motion, int(out.motion_knot), out.motion_knot_degree,
            int(out.motion_rate_knot), out.motion_rate_knot_degree))


@compiled
def path_pa(par: np.record, path_rules: FloatArray, st: np.record,
            out: np.record) -> tuple[float, float]:
    """Return what path rules and numbers of the model add [Pa] at the lead reference."""
    path, lead_m = st.model.lead_path, st.lead_m
    return (muscle_model.rules_pa(par, path_rules, path, lead_m),
            muscle_model.numbers_pa(par, st.model, path, lead_m, out.inverse_pa))


@compiled
def moving_pa(par: np.record, st: np.record) -> float:
    """Return what rate and acceleration of the lead reference take [Pa]."""
    damping = par.rate_feedforward_pa_s_per_m
    inertia = par.acceleration_feedforward_pa_s2_per_m
    if par.has_model > 0.5:
        damping = muscle_model.damping_pa_s_per_m(par, st.model, st.moves_m_per_s)
        inertia = par.inertia_feedforward * muscle_model.inertia_pa_s2_per_m(
            par, st.model, st.lead_m)
    return float(damping * st.moves_m_per_s + inertia * st.moves_m_per_s2)


@compiled
def output_pa(par: np.record, values: Tables, st: np.record,
              out: np.record) -> tuple[float, float, float]:
    """
    Return what rules and model add where the last tick was [Pa].

    That is all tables with the numbers of the path, what of it the path adds, and besides what
    moving takes.
    """
    feedback, feedforward, motion = rules_pa(par, values, out)
    rules, numbers = path_pa(par, values[3], st, out)
    return (feedback + st.rules_share * feedforward + st.rules_share * motion + rules + numbers,
            rules + numbers, moving_pa(par, st))


@compiled
def keep_command(par: np.record, st: np.record, before: tuple[float, float, float],
                 now: tuple[float, float, float]) -> None:
    """
    Let the integral take what ``output_pa`` changed by when the rules were exchanged.

    The feed-forward of the valve's lag is to see no change either. Revision 0 took it for one of a
    tick, and left out what moving takes.
    """
    change_pa = before[0] - now[0]
    if par.revision > 0.5:
        change_pa += before[2] - now[2]
        st.quasi_static_pa += par.lag_share * (now[1] - before[1]) + now[2] - before[2]
    shape = st.integral_shape if st.integral_shape > 0.0 else 1.0       # 0 before the first tick
    limit = par.integral_limit_pa
    st.integral_pa = min(max(st.integral_pa + change_pa / shape, -limit), limit)


@compiled
def _output(par: FloatArray, tables: Tables, st: FloatArray,
            out: FloatArray) -> tuple[float, float, float]:
    """Run ``output_pa`` on arrays."""
    return output_pa(part(par, 0, PARAMETERS), layer(tables, 0), part(st, 0, STATE),
                     part(out, 0, OUTPUT))


def _entry(key: int) -> Compiled[..., tuple[float, float, float]]:
    """Return that function as one unit of compiled code, stored under ``key``."""
    @entry_point
    def sofc_output(par: FloatArray, tables: Tables, st: FloatArray,
                    out: FloatArray) -> tuple[float, float, float]:
        """
        Return ``output_pa`` where the last tick was.

        Parameters
        ----------
        par, tables, st, out
            As of ``step.sofc_step``.

        """
        if key < 0:       # never; makes the key part of what is stored
            return 0.0, 0.0, 0.0
        return _output(par, tables, st, out)

    return sofc_output


sofc_output = _entry(source_key(_output))
