// SPDX-License-Identifier: Apache-2.0
using UnityEditor;
using UnityEngine;

namespace StereoCell.Editor
{
    /// <summary>Draws a channel as one line of the Inspector: visibility, colour, and name of the transfer
    /// function.</summary>
    [CustomPropertyDrawer(typeof(Channel))]
    public sealed class ChannelDrawer : PropertyDrawer
    {
        public override void OnGUI(Rect position, SerializedProperty property, GUIContent label)
        {
            var visible = property.FindPropertyRelative("isVisible");
            var function = property.FindPropertyRelative("function");
            var functions = property.FindPropertyRelative("functions");
            var names = new string[functions.arraySize];
            for (var i = 0; i < names.Length; i++) names[i] = functions.GetArrayElementAtIndex(i).stringValue;

            EditorGUI.BeginProperty(position, label, property);
            var part = position;
            part.width = 0.4f * position.width;
            visible.boolValue = EditorGUI.ToggleLeft(part, property.FindPropertyRelative("name").stringValue, visible.boolValue);
            part.x += part.width;
            part.width = 0.2f * position.width;
            EditorGUI.PropertyField(part, property.FindPropertyRelative("color"), GUIContent.none);
            part.x += part.width;
            part.width = 0.4f * position.width;
            function.intValue = EditorGUI.Popup(part, function.intValue, names);
            EditorGUI.EndProperty();
        }
    }
}
